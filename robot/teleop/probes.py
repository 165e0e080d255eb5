"""The probe list: which short, slow moves show a person that an arm keeps its limits, and the box they stay in. Pure.

Each begins and ends where the tool stood when the list began, but for the last, after which nobody asks for anything.
"""

from enum import StrEnum

import msgspec

from config.limits import Fence, Profile
from config.resolved import Resolved
from robot.errors import SafetyError
from robot.messages import Box3, Intent, JointTarget, Twist, Vec3, Vec6

__all__ = ["ASKED_M_S", "MOST_M_S", "PROFILE", "STEP_S", "Kind", "Probe", "asks_of", "plan", "probe_rig_of"]

STEP_S = 0.02
PROFILE = "probe"
"""The rig's profile, narrowed: no other is armed for the list."""
MOST_M_S, MOST_JOINT_RAD_S = 0.05, 0.5
ASKED_M_S, ASKED_RAD_S = 0.035, 0.1
"""What is asked for is less than what is let, so that a servo that overshoots still keeps it."""
WAY_M, TURN_RAD = 0.04, 0.1
UNDER_WAY_M = 0.025
"""The tool has come so far when the driver lets go, or falls silent."""
WALL_M, AT_WALL_M = 0.03, 0.05
"""Where a wall is put beside the tool, and how far the tool is driven at it."""
ROOM_M = 0.055
"""What the tool needs on every other side."""
MARGIN_M = 0.005
UPRIGHT_RAD = 0.009
"""Motion takes a tool for upright up to 10 mrad, and rights one that is tilted farther as soon as it moves."""
WRIST = 5


class Kind(StrEnum):
    """What a probe shows."""

    TURN = "turn"
    LINE = "line"
    RELEASE = "release"
    WALL = "wall"
    SILENCE = "silence"


class Probe(msgspec.Struct, frozen=True, kw_only=True):
    """One move of the list."""

    name: str
    kind: Kind
    told: str
    """What will move, how far and how fast, for a person."""
    along: Vec3 = (0.0, 0.0, 0.0)
    """Direction of the tool, base frame; not of a turn."""


def plan(tool_m: Vec3, room_m: Box3, *, tilt_rad: float) -> tuple[tuple[Probe, ...], Fence]:
    """Return the list for a tool that stands somewhere, and the box that it stays in, a wall at one of its sides.

    Args:
        tool_m: the tool, base frame.
        room_m: where it may be by arm, scenario and profile.
        tilt_rad: how far it is from pointing straight down.

    Raises:
        SafetyError: it is tilted, or there is too little room about it.
    """
    if not tilt_rad <= UPRIGHT_RAD:
        raise SafetyError(
            f"probe list: expected a tool that points straight down, within {1e3 * UPRIGHT_RAD:g} mrad, it is tilted "
            f"by {1e3 * tilt_rad:.0f}: motion would right it first, by more than a probe may move; bring the arm home"
        )
    low = [t - a for t, a in zip(tool_m, room_m[0], strict=True)]
    high = [b - t for t, b in zip(tool_m, room_m[1], strict=True)]
    for name, below, above, least in zip("xyz", low, high, (ROOM_M, WALL_M + MARGIN_M, MARGIN_M), strict=True):
        if min(below, above) < least or max(below, above) < ROOM_M:
            raise _no_room(name, below, above)
    up = 1.0 if high[2] >= ROOM_M else -1.0
    side = 1.0 if high[1] >= low[1] else -1.0  # the wall stands on the other one
    ahead = 1.0 if high[0] >= low[0] else -1.0
    return _probes(ahead, side, up), _box(tool_m, side, up)


def _probes(ahead: float, side: float, up: float) -> tuple[Probe, ...]:
    x, y, z, wall = (ahead, 0.0, 0.0), (0.0, side, 0.0), (0.0, 0.0, up), (0.0, -side, 0.0)
    mm, mm_s = f"{1e3 * WAY_M:g} mm", f"at {1e3 * ASKED_M_S:g} mm/s"
    left, right = ("left", "right") if side > 0.0 else ("right", "left")
    turn = f"the hand turns about the vertical by {TURN_RAD:g} rad at {ASKED_RAD_S:g} rad/s, and back"
    return (
        Probe(name="wrist_3", kind=Kind.TURN, told=turn),
        Probe(name="x", kind=Kind.LINE, along=x, told=f"the tool moves {mm} {_ahead(ahead)} {mm_s}, and back"),
        Probe(name="y", kind=Kind.LINE, along=y, told=f"the tool moves {mm} to its {left} {mm_s}, and back"),
        Probe(name="z", kind=Kind.LINE, along=z, told=f"the tool moves {mm} {'up' if up > 0.0 else 'down'} {mm_s}, "
              "and back"),
        Probe(name="release", kind=Kind.RELEASE, along=y, told=f"the tool moves to its {left} {mm_s}, is let go of "
              f"after {1e3 * UNDER_WAY_M:g} mm and must stop, then moves back"),
        Probe(name="wall", kind=Kind.WALL, along=wall, told=f"the tool is driven {1e3 * AT_WALL_M:g} mm to its {right} "
              f"{mm_s}, at a wall that was put {1e3 * WALL_M:g} mm beside it: it must end before it, then moves back"),
        Probe(name="silence", kind=Kind.SILENCE, along=y, told=f"the tool moves to its {left} {mm_s}; after "
              f"{1e3 * UNDER_WAY_M:g} mm nobody asks for anything any more: it must stop, latch and be let go of"),
    )  # fmt: skip


def _ahead(ahead: float) -> str:
    return "away from the arm's base" if ahead > 0.0 else "towards the arm's base"


def _box(tool_m: Vec3, side: float, up: float) -> Fence:
    """Return the box that the list stays in: its wall is one side of it."""
    x, y, z = tool_m
    left, right = (ROOM_M, WALL_M) if side > 0.0 else (WALL_M, ROOM_M)
    above, below = (ROOM_M, MARGIN_M) if up > 0.0 else (MARGIN_M, ROOM_M)
    return Fence(
        name="probe_box", low_m=(x - ROOM_M, y - right, z - below), high_m=(x + ROOM_M, y + left, z + above)
    )  # fmt: skip


def _no_room(axis: str, below: float, above: float) -> SafetyError:
    return SafetyError(
        f"probe list: expected {1e3 * ROOM_M:g} mm about the tool inside of its limits, along {axis} there are "
        f"{1e3 * below:.0f} mm and {1e3 * above:.0f} mm; lead the tool to the middle of the table, at travel height"
    )


def probe_rig_of(resolved: Resolved, box: Fence) -> Resolved:
    """Return a rig that holds its profile and, narrower, the list's own speeds and box; nothing is wider."""
    profile = resolved.profile
    speeds = {name: min(getattr(profile.speeds, name), MOST_M_S) for name in ("tcp_m_s", "elbow_m_s", "flange_m_s")}
    a, b, c, d, e, f = (
        msgspec.structs.replace(joint, speed_rad_s=min(joint.speed_rad_s, MOST_JOINT_RAD_S)) for joint in profile.joints
    )
    space = profile.workspace
    narrowed: Profile = msgspec.structs.replace(
        profile,
        name=PROFILE,
        joints=(a, b, c, d, e, f),
        speeds=msgspec.structs.replace(profile.speeds, **speeds),
        workspace=msgspec.structs.replace(space, boxes=(*space.boxes, box)),
    )
    others = tuple(known for known in resolved.limits.profiles if known.name != PROFILE)
    return msgspec.structs.replace(
        resolved,
        limits=msgspec.structs.replace(resolved.limits, profiles=(*others, narrowed)),
        rig=msgspec.structs.replace(resolved.rig, profile=PROFILE),
    )


def asks_of(probe: Probe, q_rad: Vec6) -> tuple[Intent, ...]:
    """Return what a probe asks for on its way out, step by step; what follows is up to its kind.

    Args:
        probe: which.
        q_rad: the joints when it begins.
    """
    if probe.kind is Kind.TURN:
        n = round(TURN_RAD / ASKED_RAD_S / STEP_S)
        return tuple(JointTarget(q_rad=turned(q_rad, TURN_RAD * k / n)) for k in range(1, n + 1))
    way_m = {Kind.LINE: WAY_M, Kind.WALL: AT_WALL_M}.get(probe.kind, UNDER_WAY_M)
    x, y, z = probe.along
    twist = Twist(linear_m_s=(ASKED_M_S * x, ASKED_M_S * y, ASKED_M_S * z))
    return (twist,) * round(way_m / ASKED_M_S / STEP_S)


def turned(q_rad: Vec6, by_rad: float) -> Vec6:
    """Return joints with the last one turned."""
    a, b, c, d, e, f = q_rad
    return a, b, c, d, e, f + by_rad
