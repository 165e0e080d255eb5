"""A limits profile made ready for the loops that run every tick: fences as gaps, speeds as steps. Pure maths.

Motion slows down by it and the gate refuses by it.
"""

import math

import msgspec
import numpy as np

from config.arm import ArmConfig
from config.limits import ArmPart, KeepOut, Plane, Profile
from robot.braking import Braking
from robot.compiled import Table, compiled
from robot.fences import FenceGap, box_gap, keep_out_gap, plane_gap
from robot.messages import Vec3

__all__ = [
    "SLOWEST_SHARE",
    "Envelope",
    "JointEnd",
    "braking_step",
    "soft_step",
]

PARTS = (ArmPart.TCP, ArmPart.FLANGE, ArmPart.ELBOW)
"""Order of the points that chain.ToolChain.points returns."""
FAR_M = 0.01
BRAKING = Braking()
N_FENCE = 9
CONE_NEAR_RAD = 1.0
SLOWEST_SHARE = 0.1
"""Share of a joint's greatest speed that is left at its very end."""


class JointEnd(msgspec.Struct, frozen=True):
    """What bounds one joint."""

    low_rad: float
    high_rad: float
    margin_rad: float
    step_rad: float
    """Greatest change of its command in one tick."""
    gain_rad: float
    """Greatest gain of that change from tick to tick, by its acceleration."""
    jerk_rad: float
    """Greatest change of that gain while it grows, by its jerk."""
    stop_rad: float
    """Greatest change of that change for whatever reason, by the acceleration of a stop."""
    stop_jerk_rad: float
    """Greatest change of that, by the jerk of a stop."""


def _nothing() -> Table:
    return np.empty((0, 0))


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """One profile of one arm at one tick, base frame, joints base to wrist 3."""

    tick_s: float
    joints: tuple[JointEnd, ...]
    part_step_m: Vec3
    """Greatest way of the tool centre point, the flange and the elbow in one tick."""
    fences: tuple[FenceGap, ...]
    cone_rad: float
    cone_cosine: float
    cone_near_cosine: float
    """Nearer to straight down than this, no tilt of a tick's length matters."""
    fence_braking_m: float
    """Change of the way per tick, from tick to tick, that is counted on ahead of a fence."""
    onset: float
    """Ticks that it takes at the most until a joint that gathered speed as it may brakes as it may, halved."""
    overshoot: float
    """A part that gathers speed goes on by its gain of a tick times this while its joints' jerk ends the gain."""
    fence_far_m: float
    """From a gap this wide no part needs to slow down, however fast it goes."""
    joint_rows: Table = msgspec.field(default_factory=_nothing)
    """(6, 8) the joints, field by field; made from them."""
    fence_rows: Table = msgspec.field(default_factory=_nothing)
    """(n, 9) the fences, part and row; made from them."""

    def __post_init__(self) -> None:
        set_field = msgspec.structs.force_setattr
        set_field(self, "joint_rows", np.array([msgspec.structs.astuple(joint) for joint in self.joints], dtype=float))
        rows = [(float(fence.part), *fence.row) for fence in self.fences]
        set_field(self, "fence_rows", np.array(rows, dtype=float).reshape(-1, N_FENCE))

    @classmethod
    def of(cls, profile: Profile, arm: ArmConfig, *, tick_s: float) -> "Envelope":
        """Return a profile made ready.

        Args:
            profile: what may be done.
            arm: the arm as config.limited left it: no wider than the profile.
            tick_s: how long each command holds.
        """
        space, speeds = profile.workspace, profile.speeds
        braking = profile.stopping.deceleration_m_s2 * tick_s * tick_s
        fastest = max(speeds.tcp_m_s, speeds.flange_m_s, speeds.elbow_m_s)
        joints = tuple(
            JointEnd(
                joint.range_rad[0],
                joint.range_rad[1],
                limit.soft_margin_rad,
                joint.speed_rad_s * tick_s,
                limit.acceleration_rad_s2 * tick_s**2,
                limit.jerk_rad_s3 * tick_s**3,
                limit.stop_acceleration_rad_s2 * tick_s**2,
                limit.stop_jerk_rad_s3 * tick_s**3,
            )
            for joint, limit in zip(arm.joints, profile.joints, strict=True)
        )
        onset = max([(j.gain_rad + j.stop_rad) / (2.0 * j.stop_jerk_rad) for j in joints])
        own_m = fastest * fastest / (2.0 * profile.stopping.deceleration_m_s2)
        worst_m = fastest * max([j.step_rad for j in joints]) / tick_s / (2.0 * BRAKING.least_rad_s2)
        fences = [box_gap(f.name, PARTS.index(part), f.low_m, f.high_m) for f in space.boxes for part in f.parts]
        planes = [_plane(plane, part) for plane in space.planes for part in plane.parts]
        outs = [_keep_out(out, part) for out in space.keep_outs for part in out.parts]
        return cls(
            tick_s=tick_s,
            joints=joints,
            part_step_m=(speeds.tcp_m_s * tick_s, speeds.flange_m_s * tick_s, speeds.elbow_m_s * tick_s),
            fences=(*fences, *planes, *outs),
            cone_rad=space.tool_cone_rad,
            cone_cosine=math.cos(space.tool_cone_rad),
            cone_near_cosine=math.cos(max(0.0, space.tool_cone_rad - CONE_NEAR_RAD)),
            fence_braking_m=braking,
            onset=onset,
            overshoot=max([0.0, *((j.gain_rad / j.stop_jerk_rad - 1.0) / 2.0 for j in joints)]),
            fence_far_m=FAR_M + onset * tick_s * fastest + max(own_m, worst_m),
        )


@compiled
def braking_step(gap: float, braking: float, onset: float) -> float:
    """Return the longest step of one tick after which what is left of a gap still suffices to come to rest in.

    A step s leaves gap - s, is gone on with for the onset n, and then the steps fall by `braking` a tick:
    s^2 <= 2 braking (gap - (1 + n) s), the law v^2 <= 2 a d at the end of the tick.

    Args:
        gap: what is left before the step; 0 or less allows none.
        braking: a t^2, greatest change of a step from tick to tick.
        onset: ticks that it takes until braking is as good as begun, by its jerk.
    """
    lost = (1.0 + onset) * braking
    return math.sqrt(lost * lost + 2.0 * braking * gap) - lost if gap > 0.0 else 0.0


@compiled
def soft_step(gap: float, margin: float, step: float) -> float:
    """Return the longest step towards an end from a gap before it: from `step` at the margin down to a tenth of it.

    The step s is held to what is allowed where it ends: s <= step (S + (1 - S) (gap - s) / margin).
    """
    if margin <= 0.0:
        return step
    return max(0.0, step * (SLOWEST_SHARE + (1.0 - SLOWEST_SHARE) * gap / margin)) / (
        1.0 + step * (1.0 - SLOWEST_SHARE) / margin
    )


def _plane(plane: Plane, part: ArmPart) -> FenceGap:
    length = math.hypot(*plane.normal)
    x, y, z = (v / length for v in plane.normal)
    px, py, pz = plane.point_m
    return plane_gap(plane.name, PARTS.index(part), (x, y, z), x * px + y * py + z * pz)


def _keep_out(out: KeepOut, part: ArmPart) -> FenceGap:
    return keep_out_gap(out.name, PARTS.index(part), out.low_m, out.high_m, out.radius_m)
