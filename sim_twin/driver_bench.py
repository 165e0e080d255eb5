"""The driver bench: what the limits cost whoever means well, in time and in space that cannot be used."""

import math
from collections.abc import Callable, Iterator
from time import perf_counter

import msgspec
from msgspec.structs import replace

from config.limits import Fence, JointLimit, KeepOut, Plane, Workspace
from config.loader import resolve
from config.resolved import Resolved
from config.scenario import Box
from robot.bench import BenchReport, BenchResult, bench_report
from robot.kinematics import ToolChain
from robot.messages import Hold, Intent, JointTarget, Twist, Vec3
from robot.safety import Clearance, Hard
from sim_twin.honest_driver import CAP_M_S, Drive, drive_at, reaches_s

__all__ = ["Trial", "bench_driver", "clearance_trials", "fence_trials", "joint_trials"]

MOST_RATIO, MOST_MM, MOST_MRAD = 1.15, 20.0, 20.0
SLACK = 0.1
"""A joint that bears a load rests a little below its command: so much of what may be left may be overrun."""
PROFILE = "attended"
WIDE = ((-0.85, -0.85, 0.015), (0.85, 0.85, 0.9))
"""Workspace of the arm's file for drives at something else."""
LOW, HIGH = (0.3, -0.2, 0.1), (0.52, 0.2, 0.3)
"""A box well inside of where the arm can go: every face is met by the tool and by nothing else before."""
SLANTED = (0.6, 0.0, 0.8)
TURN_RAD, BEYOND_RAD = 0.25, 0.2
"""How far from its beginning a joint's end is put, and how far beyond it is asked for."""
TOWER = Box(name="tower", position_m=(0.62, 0.0), colour=(0.5, 0.5, 0.5), inner_m=(0.05, 0.3), height_m=0.35)
FAR_M = 0.3
JOINTS = range(6)


class Trial(msgspec.Struct, frozen=True, kw_only=True):
    """A drive straight at one limit."""

    name: str
    resolved: Resolved
    intent: Intent
    gap: Callable[[Drive], tuple[float, float]]
    """How far from the limit it began and came to rest."""
    unit: str = "mm"
    most: float = MOST_MM

    def row(self) -> BenchResult:
        """Drive, and tell how much was left."""
        came = drive_at(self.resolved, self.intent)
        began, left = self.gap(came)
        used = 1.0 - left / began
        return BenchResult(
            name=f"left_{self.name}", value=1e3 * left, unit=self.unit, goal=f"0 to {self.most:g}",
            ok=-SLACK * self.most <= 1e3 * left <= self.most and not came.refused,
            details={"way used": f"{100 * used:.1f} %", "limited by": " ".join(came.limiters) or "nothing"}
            | ({"refused": came.refused} if came.refused else {}),
        )  # fmt: skip


def _opened(resolved: Resolved, workspace: Workspace, *, is_wide: bool = True) -> Resolved:
    """Return the rig with one workspace of the profile alone in force, beside reach and bodies."""
    motion = replace(resolved.arm.motion, workspace_m=WIDE) if is_wide else resolved.arm.motion
    profiles = tuple(replace(p, workspace=workspace) for p in resolved.limits.profiles)
    return replace(
        resolved, arm=replace(resolved.arm, motion=motion), limits=replace(resolved.limits, profiles=profiles),
        scenario=replace(resolved.scenario, workspace_m=None),
    )  # fmt: skip


def _twist(direction: Vec3) -> Twist:
    x, y, z = (CAP_M_S * v / math.hypot(*direction) for v in direction)
    return Twist(linear_m_s=(x, y, z))


def fence_trials(resolved: Resolved) -> Iterator[Trial]:
    """Yield drives at each face of a box, at a plane and at a volume, the tool alone being fenced."""
    boxed = _opened(resolved, Workspace(boxes=(Fence(name="box", low_m=LOW, high_m=HIGH),)))
    for axis, letter in enumerate("xyz"):
        for sign, end, side in ((-1.0, LOW, "low"), (1.0, HIGH, "high")):
            direction = [0.0, 0.0, 0.0]
            direction[axis] = sign
            x, y, z = direction
            yield Trial(
                name=f"box_{letter}_{side}", resolved=boxed, intent=_twist((x, y, z)),
                gap=_along(axis, sign, end[axis]),
            )  # fmt: skip
    plane = Plane(name="slant", point_m=(0.3, 0.0, 0.12), normal=SLANTED)
    yield Trial(
        name="plane", resolved=_opened(resolved, Workspace(planes=(plane,))), intent=_twist((-0.6, 0.0, -0.8)),
        gap=lambda d: (_above(d.start_m, plane), _above(d.rest_m, plane)),
    )  # fmt: skip
    wall = KeepOut(name="wall", low_m=(0.25, 0.18, 0.0), high_m=(0.65, 0.3, 0.5))
    yield Trial(
        name="keep_out", resolved=_opened(resolved, Workspace(keep_outs=(wall,))), intent=_twist((0.0, 1.0, 0.0)),
        gap=_along(1, 1.0, wall.low_m[1]),
    )  # fmt: skip


def joint_trials(resolved: Resolved) -> Iterator[Trial]:
    """Yield a drive of each joint at either end of a range that was narrowed around where the arm begins."""
    opened = _opened(resolved, Workspace())
    home = drive_at(opened, Hold()).start_rad
    for i in JOINTS:
        for sign, side in ((-1.0, "low"), (1.0, "high")):
            end = home[i] + sign * TURN_RAD
            profiles = tuple(
                replace(p, joints=tuple(_ended(j, sign, end) if k == i else j for k, j in enumerate(p.joints)))
                for p in opened.limits.profiles
            )
            asked = [q + (sign * (TURN_RAD + BEYOND_RAD) if k == i else 0.0) for k, q in enumerate(home)]
            a, b, c, d, e, f = asked
            yield Trial(
                name=f"joint_{i + 1}_{side}", intent=JointTarget(q_rad=(a, b, c, d, e, f)), unit="mrad", most=MOST_MRAD,
                resolved=replace(opened, limits=replace(opened.limits, profiles=profiles)),
                gap=_turned(i, sign, end),
            )  # fmt: skip


def _ended(joint: JointLimit, sign: float, end_rad: float) -> JointLimit:
    low, high = joint.range_rad
    return replace(joint, range_rad=(end_rad, high) if sign < 0.0 else (low, end_rad))


def clearance_trials(resolved: Resolved) -> Iterator[Trial]:
    """Yield drives of the tool at the table and of the palm at a tower."""
    opened = _opened(resolved, Workspace())
    chain, least_m = ToolChain(opened.arm), opened.arm.motion.table_clearance_m + opened.scenario.table.height_m

    def over_table(drive: Drive) -> tuple[float, float]:
        heights = [chain.tcp_and_lowest(q)[1] - least_m for q in (drive.start_rad, drive.rest_rad)]
        return heights[0], heights[1]

    yield Trial(name="table", resolved=opened, intent=_twist((0.0, 0.0, -1.0)), gap=over_table)
    towered = replace(opened, scenario=replace(opened.scenario, boxes=(*opened.scenario.boxes, TOWER)))
    yield Trial(
        name="clearance_box", resolved=towered, intent=_twist((1.0, 0.0, 0.0)), gap=_between_bodies(towered),
    )  # fmt: skip


def _along(axis: int, sign: float, end_m: float) -> Callable[[Drive], tuple[float, float]]:
    return lambda d: (sign * (end_m - d.start_m[axis]), sign * (end_m - d.rest_m[axis]))


def _turned(i: int, sign: float, end_rad: float) -> Callable[[Drive], tuple[float, float]]:
    return lambda d: (sign * (end_rad - d.start_rad[i]), sign * (end_rad - d.rest_rad[i]))


def _above(at_m: Vec3, plane: Plane) -> float:
    return sum(n * (a - p) for n, a, p in zip(plane.normal, at_m, plane.point_m, strict=True))


def _between_bodies(resolved: Resolved) -> Callable[[Drive], tuple[float, float]]:
    """Return what tells the least gap beyond what the profile keeps; all that is far is told as so far."""
    kept = resolved.profile.clearances
    hard = Hard(own_m=kept.self_m, table_m=kept.scene_m, thing_m=kept.scene_m)

    def gap(drive: Drive) -> tuple[float, float]:
        clearance = Clearance(resolved.arm, resolved.scenario, hard=hard, reach_m=FAR_M)
        return clearance.gap(drive.start_rad), clearance.gap(drive.rest_rad)

    return gap


def bench_driver(*, full: bool) -> BenchReport:
    """Reach with shaping on and off, and drive straight at every limit: what is left before it when the tool rests."""
    del full  # it is short, and the same every time
    begin = perf_counter()
    resolved = resolve()
    resolved = replace(resolved, rig=replace(resolved.rig, profile=PROFILE))
    shaped, bare = (sum(reaches_s(resolved, is_shaped=on)) for on in (True, False))
    rows = [
        BenchResult(
            name="reach_time_ratio", value=shaped / bare, unit="1", goal=f"<= {MOST_RATIO:g}",
            ok=shaped / bare <= MOST_RATIO,
        ),
        BenchResult(name="reaches_shaped_s", value=shaped, unit="s"),
        BenchResult(name="reaches_bare_s", value=bare, unit="s"),
    ]  # fmt: skip
    for trials in (fence_trials, joint_trials, clearance_trials):
        rows += [trial.row() for trial in trials(resolved)]
    return bench_report("driver", rows, seconds=perf_counter() - begin)
