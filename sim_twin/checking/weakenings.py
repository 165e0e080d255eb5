"""Which limits are weakened by 5 %, how each is made to bind first, and those that 5 % cannot show of, with the reason.

Every field of a profile is in one of the two lists; a test holds them to that.
"""

from collections.abc import Callable

import msgspec

from config.arm import ArmConfig
from config.limits import ArmPart, Fence, KeepOut, Plane, Profile

__all__ = ["BY", "MUTATIONS", "NOT_SHOWN", "Mutation"]

BY = 1.05
replace = msgspec.structs.replace


def _same(arm: ArmConfig) -> ArmConfig:
    return arm


def _firmer(arm: ArmConfig) -> ArmConfig:
    """Return the arm whose hand grips harder than the least that is tried: its own least is what it grips with."""
    return replace(arm, tool=replace(arm.tool, grip_force_n=50.0))


class Mutation(msgspec.Struct, frozen=True, kw_only=True):
    """One limit, how it is made to bind, how it is weakened, and the families of streams that go for it."""

    name: str
    limits: tuple[str, ...]
    """Where in a profile it stands."""
    told_by: tuple[str, ...]
    """Readings of which one must be broken."""
    families: tuple[str, ...]
    tighten: Callable[[Profile], Profile]
    weaken: Callable[[Profile], Profile] | None = None
    """For the stack; None where no part of the stack but the plant keeps it: then its brake is weakened."""
    refit: Callable[[ArmConfig], ArmConfig] = _same
    """The arm whose own file would hide it."""
    fit: Callable[[Profile, float], Profile] | None = None
    """Sets the limit to the worst that came of the plant as it is, where that alone says what binds."""
    n_streams: int = 12
    """At most so many are tried."""


def _joints(profile: Profile, **by: float) -> Profile:
    joints = tuple(replace(j, **{key: getattr(j, key) * factor for key, factor in by.items()}) for j in profile.joints)
    return replace(profile, joints=joints)


def _set_joints(profile: Profile, **values: float) -> Profile:
    return replace(profile, joints=tuple(replace(j, **values) for j in profile.joints))


def _narrow(profile: Profile) -> Profile:
    """Leave each joint so much round the pose over the table that the workspace does not hide its range."""
    home, half = (2.8186, -1.7634, 2.014, -1.8213, -1.5708, -1.8938), (0.35, 0.35, 0.4, 0.4, 0.3, 0.6)
    joints = tuple(
        replace(j, range_rad=(q - h, q + h), soft_margin_rad=0.1)
        for j, q, h in zip(profile.joints, home, half, strict=True)
    )
    return replace(profile, joints=joints)


def _widen(profile: Profile) -> Profile:
    def wide(span: tuple[float, float]) -> tuple[float, float]:
        middle, half = (span[0] + span[1]) / 2.0, (span[1] - span[0]) / 2.0 * BY
        return middle - half, middle + half

    return replace(profile, joints=tuple(replace(j, range_rad=wide(j.range_rad)) for j in profile.joints))


def _speeds(profile: Profile, **values: float) -> Profile:
    return replace(profile, speeds=replace(profile.speeds, **values))


def _space(profile: Profile, **values: object) -> Profile:
    return replace(profile, workspace=replace(profile.workspace, **values))


def _fence(by: float) -> tuple[Fence, ...]:
    low, high = (0.27, -0.3, 0.04), (0.59, 0.3, 0.28)
    middle = [(a + b) / 2.0 for a, b in zip(low, high, strict=True)]
    half = [(b - a) / 2.0 * by for a, b in zip(low, high, strict=True)]
    low = (middle[0] - half[0], middle[1] - half[1], middle[2] - half[2])
    high = (middle[0] + half[0], middle[1] + half[1], middle[2] + half[2])
    return (Fence(name="inner", low_m=low, high_m=high),)


def _plane(by: float) -> tuple[Plane, ...]:
    return (Plane(name="far", point_m=(0.55 * by, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), parts=(ArmPart.TCP,)),)


def _ball(by: float) -> tuple[KeepOut, ...]:
    centre = (0.42, 0.1, 0.11)
    return (KeepOut(name="ball", low_m=centre, high_m=centre, radius_m=0.08 / by),)


def _grip(profile: Profile, **values: tuple[float, float]) -> Profile:
    return replace(profile, grip=replace(profile.grip, **values))


def _clear(profile: Profile, **values: float) -> Profile:
    return replace(profile, clearances=replace(profile.clearances, **values))


def _stopping(profile: Profile, **values: float) -> Profile:
    return replace(profile, stopping=replace(profile.stopping, **values))


def _soft(profile: Profile) -> Profile:
    """Make soft margins wide and joints slow, so that the margin's law binds and no braking distance does."""
    return _set_joints(_narrow(profile), soft_margin_rad=0.25, speed_rad_s=0.8)


def _fast(profile: Profile) -> Profile:
    """Let the tool go as fast as an arm without people may, so that a stop has something to take off."""
    return _stopping(_speeds(profile, tcp_m_s=1.0, flange_m_s=1.0, elbow_m_s=1.0), time_s=2.0, distance_m=1.0)


def _steady(profile: Profile, steady_n: float) -> Profile:
    return replace(profile, contact_force=replace(profile.contact_force, steady_n=steady_n))


_FAST = ("full_speed", "fast_joints", "steps", "random_joints", "gate_at_places", "gate_jumps")
_PLACES = ("at_the_box", "circles", "at_the_fences", "random_walk", "gate_at_places", "random_joints")
_STOPS = ("gate_jumps", "not_finite", "gate_at_places", "malformed")
MUTATIONS: tuple[Mutation, ...] = (
    Mutation(
        name="joint range", limits=("joints.range_rad",), told_by=("joint_range",), tighten=_narrow, weaken=_widen,
        families=("at_the_joints", "random_joints", "gate_at_places", "fast_joints"),
    ),
    Mutation(
        name="soft margin", limits=("joints.soft_margin_rad",), told_by=("command_soft_margin",), tighten=_soft,
        weaken=lambda p: _joints(p, soft_margin_rad=1.0 / BY),
        families=("gate_at_places", "at_the_joints", "random_joints", "fast_joints"),
    ),
    Mutation(
        name="joint speed", limits=("joints.speed_rad_s",), told_by=("command_speed",),
        tighten=lambda p: _set_joints(p, speed_rad_s=0.4), weaken=lambda p: _joints(p, speed_rad_s=BY),
        families=("gate_at_places", *_FAST),
    ),
    Mutation(
        name="joint acceleration", limits=("joints.acceleration_rad_s2",),
        told_by=("joint_acceleration", "command_acceleration"),
        tighten=lambda p: _set_joints(
            p, acceleration_rad_s2=3.0, stop_acceleration_rad_s2=3.6, jerk_rad_s3=96.0, stop_jerk_rad_s3=360.0
        ),
        weaken=lambda p: _joints(p, acceleration_rad_s2=BY), families=_FAST,
    ),
    Mutation(
        name="joint stop acceleration", limits=("joints.stop_acceleration_rad_s2",),
        told_by=("command_stop_acceleration",),
        tighten=lambda p: _set_joints(p, acceleration_rad_s2=3.0, stop_acceleration_rad_s2=3.0),
        weaken=lambda p: _joints(p, stop_acceleration_rad_s2=BY), families=_FAST,
    ),
    Mutation(
        name="joint jerk", limits=("joints.jerk_rad_s3",), told_by=("command_jerk",),
        tighten=lambda p: _set_joints(p, jerk_rad_s3=60.0), weaken=lambda p: _joints(p, jerk_rad_s3=BY), families=_FAST,
    ),
    Mutation(
        name="joint stop jerk", limits=("joints.stop_jerk_rad_s3",), told_by=("command_stop_jerk",),
        tighten=lambda p: _set_joints(p, jerk_rad_s3=400.0, stop_jerk_rad_s3=400.0),
        weaken=lambda p: _joints(p, stop_jerk_rad_s3=BY), families=_FAST,
    ),
    Mutation(
        name="tcp speed", limits=("speeds.tcp_m_s",), told_by=("tcp_speed", "command_tcp_speed"),
        tighten=lambda p: _speeds(p, tcp_m_s=0.2), weaken=lambda p: _speeds(p, tcp_m_s=0.2 * BY), families=_FAST,
    ),
    Mutation(
        name="flange speed", limits=("speeds.flange_m_s",), told_by=("flange_speed", "command_flange_speed"),
        tighten=lambda p: _speeds(p, flange_m_s=0.15), weaken=lambda p: _speeds(p, flange_m_s=0.15 * BY),
        families=_FAST,
    ),
    Mutation(
        name="elbow speed", limits=("speeds.elbow_m_s",), told_by=("elbow_speed", "command_elbow_speed"),
        tighten=lambda p: _speeds(p, elbow_m_s=0.12), weaken=lambda p: _speeds(p, elbow_m_s=0.12 * BY), families=_FAST,
    ),
    Mutation(
        name="box", limits=("workspace.boxes",), told_by=("box:inner",),
        tighten=lambda p: _space(p, boxes=_fence(1.0)), weaken=lambda p: _space(p, boxes=_fence(BY)), families=_PLACES,
    ),
    Mutation(
        name="plane", limits=("workspace.planes",), told_by=("plane:far",),
        tighten=lambda p: _space(p, planes=_plane(1.0)), weaken=lambda p: _space(p, planes=_plane(BY)),
        families=_PLACES,
    ),
    Mutation(
        name="keep-out", limits=("workspace.keep_outs",), told_by=("keep_out:ball",),
        tighten=lambda p: _space(p, keep_outs=_ball(1.0)), weaken=lambda p: _space(p, keep_outs=_ball(BY)),
        families=("at_the_fences", *_PLACES),
    ),
    Mutation(
        name="tool cone", limits=("workspace.tool_cone_rad",), told_by=("tool_cone",),
        tighten=lambda p: _space(p, tool_cone_rad=0.4), weaken=lambda p: _space(p, tool_cone_rad=0.4 * BY),
        families=("tilts", "random_joints", "gate_at_places"),
    ),
    Mutation(
        name="steady force", limits=("contact_force.steady_n",), told_by=("steady_force",),
        tighten=lambda p: _steady(p, 60.0), weaken=lambda p: _steady(p, 60.0 * BY),
        families=("gate_weighs",),
    ),
    Mutation(
        name="greatest grip force", limits=("grip.force_n[1]",), told_by=("command_grip_force",),
        tighten=lambda p: _grip(p, force_n=(20.0, 100.0)), weaken=lambda p: _grip(p, force_n=(20.0, 100.0 * BY)),
        families=("gate_hands", "gate_grips"),
    ),
    Mutation(
        name="least grip force", limits=("grip.force_n[0]",), told_by=("command_grip_force",),
        tighten=lambda p: _grip(p, force_n=(40.0, 235.0)), weaken=lambda p: _grip(p, force_n=(40.0 / BY, 235.0)),
        families=("gate_hands",), refit=_firmer,
    ),
    Mutation(
        name="greatest grip speed", limits=("grip.speed_m_s[1]",), told_by=("grip_speed", "command_grip_speed"),
        tighten=lambda p: _grip(p, speed_m_s=(0.02, 0.1)), weaken=lambda p: _grip(p, speed_m_s=(0.02, 0.1 * BY)),
        families=("gate_hands", "gate_grips", "mixed"),
    ),
    Mutation(
        name="least grip speed", limits=("grip.speed_m_s[0]",), told_by=("command_grip_speed",),
        tighten=lambda p: _grip(p, speed_m_s=(0.04, 0.15)), weaken=lambda p: _grip(p, speed_m_s=(0.04 / BY, 0.15)),
        families=("gate_hands",),
    ),
    Mutation(
        name="stopping time", limits=("stopping.time_s",), told_by=("stop_time",), tighten=_fast,
        fit=lambda p, time_s: _stopping(p, time_s=time_s), families=_STOPS,
    ),
    Mutation(
        name="stopping distance", limits=("stopping.distance_m",), told_by=("stop_distance",), tighten=_fast,
        fit=lambda p, distance_m: _stopping(p, distance_m=distance_m), families=_STOPS,
    ),
    Mutation(
        name="scene clearance", limits=("clearances.scene_m",), told_by=("scene_clearance", "command_scene_clearance"),
        tighten=lambda p: _clear(p, scene_m=0.035), weaken=lambda p: _clear(p, scene_m=0.035 / BY),
        families=("gate_creeps", "gate_leans", "at_the_things", "at_the_box", "tilts", "random_joints"),
    ),
    Mutation(
        name="self clearance", limits=("clearances.self_m",), told_by=("self_clearance", "command_self_clearance"),
        tighten=lambda p: _clear(_space(p, tool_cone_rad=3.0), self_m=0.07),
        weaken=lambda p: _clear(p, self_m=0.07 / BY),
        families=("gate_creeps", "tilts", "random_joints", "gate_at_places"),
    ),
)  # fmt: skip
NOT_SHOWN: dict[str, str] = {
    "contact_force.blow_n": (
        "a blow is over in the tick in which it is measured: no command can take it back. What keeps it is how fast "
        "the tool meets a thing, which is told by its own reading"
    ),
    "grip.opening_m": "the hand's own stroke ends it; a file that says less than the stroke is refused when it is read",
    "stopping.deceleration_m_s2": (
        "what motion counts on ahead of a fence, no limit of the physics: whoever counts on too much is beyond the "
        "fence, which is told"
    ),
    "contacts": (
        "no pair has a holder of its own: the tool's blow and speed bound them all, and a file whose pairs are "
        "narrower than those is refused when it is read"
    ),
}
"""Limits of which 5 % cannot show in what the physics does, and why."""
