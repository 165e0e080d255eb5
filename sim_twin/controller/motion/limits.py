"""What a slice may ask and what may be measured: which stop the first breach brings. Pure.

Two tiers, as on a robot: what is *asked* beyond a limit brings a protective stop, and what is *measured* beyond a
limit and its tolerance (the trueness of the e-Series' safety functions) is a violation and cuts the drives. Measured
speeds, which a servo's overshoot takes beyond what was asked, have both: a protective stop beyond the tolerance, a
violation where they run away. A force is a collision and so a protective stop, however hard the blow; a violation is
what goes on pressing after it. Who stands beyond a limit or a plane may stand there and come back.
"""

import math
from collections.abc import Iterable, Sequence
from enum import Enum
from operator import le

import msgspec
import numpy as np

from config.arm import ArmConfig
from robot.messages import Vec6
from sim_twin.controller.motion.plain import is_plainly_asked, is_plainly_felt
from sim_twin.controller.motion.poses import Array, six
from sim_twin.controller.motion.setpoint import SLICE_S

__all__ = [
    "FORCE_TOLERANCE_N",
    "PRESSED_S",
    "Asked",
    "Breach",
    "Cause",
    "Felt",
    "Plane",
    "SafetyLimits",
    "breach_asked",
    "breach_felt",
    "default_limits",
    "is_outside",
]

ROUNDING = 1e-9
JUMP_SPEEDS = 2.0
"""A change of more than this many slices at full speed is a jump, not a speed."""
# Trueness of the e-Series' safety functions, from the manual.
JOINT_TOLERANCE_RAD = float(np.radians(5.0))
JOINT_SPEED_TOLERANCE_RAD_S = float(np.radians(1.15))
PLANE_TOLERANCE_M = 0.040
SPEED_TOLERANCE_M_S = 0.050
FORCE_TOLERANCE_N = 25.0
PRESSED_S = 0.5
"""What presses for so long was not ended by the stop, which takes less. A guess: UR publishes no figure."""
FURTHER_RAD_S, FURTHER_M_S = 0.01, 0.005
"""Who goes further than this beyond a limit does not merely stand there."""
# Measured speeds beyond these are violations; the figures that UR's pendant shows beside its limits, recalled.
JOINT_RUNAWAY_RAD_S = float(np.radians(11.0))
TOOL_RUNAWAY_M_S = 0.150


class Cause(Enum):
    """Why the robot stops: UR's code number (0 where none is known), its argument, whether it cuts the drives.

    C153, C157 and C163 are UR's own (service note), C204A1 is quoted on its forum; C150, C152, C154, C158 and C204A2
    are recalled from its list of error codes.
    """

    NOT_FINITE = (204, 0, False)
    JUMP = (204, 1, False)
    TARGET_SPEED = (204, 2, False)
    TARGET_TOOL_SPEED = (0, 6, False)
    JOINT_SPEED = (0, 7, False)
    TOOL_SPEED = (0, 8, False)
    JOINT_LIMIT = (150, 0, False)
    PLANE = (152, 0, False)
    DEVIATION = (153, 0, False)
    SINGULARITY = (154, 0, False)
    JOINT_COLLISION = (157, 0, False)
    TOOL_COLLISION = (158, 0, False)
    TOO_MANY_STOPS = (163, 0, True)
    JOINT_VIOLATION = (0, 1, True)
    JOINT_SPEED_VIOLATION = (0, 2, True)
    TOOL_SPEED_VIOLATION = (0, 3, True)
    PLANE_VIOLATION = (0, 4, True)
    FORCE_VIOLATION = (0, 5, True)

    @property
    def code(self) -> int:
        """UR's number, 0 where none is known."""
        return self.value[0]

    @property
    def is_violation(self) -> bool:
        """It cuts the drives; otherwise it is a protective stop."""
        return self.value[2]


class Breach(msgspec.Struct, frozen=True, kw_only=True):
    """One limit that was passed."""

    cause: Cause
    text: str
    joint: int | None = None
    """0 to 5 where one joint is to blame."""

    @property
    def code(self) -> str:
        """The number as UR writes it, such as C153A2; empty where none is known."""
        argument = self.cause.value[1] if self.joint is None else self.joint
        return f"C{self.cause.code}A{argument}" if self.cause.code else ""


class Plane(msgspec.Struct, frozen=True, kw_only=True):
    """The tool stays where normal · p is at least offset; base frame, normal of length 1."""

    normal: tuple[float, float, float]
    offset_m: float


class SafetyLimits(msgspec.Struct, frozen=True, kw_only=True):
    """One set of limits; a robot has one for normal and one for reduced mode."""

    q_min_rad: Vec6
    q_max_rad: Vec6
    speed_rad_s: Vec6
    tool_speed_m_s: float = 3.0
    tool_force_n: float = 250.0
    deviation_rad: float = 0.25
    collision_nm: Vec6 = (110.0, 110.0, 110.0, 22.0, 22.0, 22.0)
    """Torque from outside on a joint that counts as a collision."""
    planes: tuple[Plane, ...] = ()


class Asked(msgspec.Struct, frozen=True, kw_only=True):
    """One slice's set-point."""

    q_rad: Array
    qd_rad_s: Array
    """Its change since the slice before."""
    tool_m: Array
    """Where it brings the tool."""
    tool_before_m: Array
    """Where the slice before brought it."""
    tool_stop_m: tuple[Array, ...] = ()
    """Where a stop that began now would bring it; needed where there are planes."""


class Felt(msgspec.Struct, frozen=True, kw_only=True):
    """One slice's measurement, beside the set-point that it should have reached by now."""

    q_rad: Array
    qd_rad_s: Array
    q_expected_rad: Array
    tool_m: Array
    tool_velocity_m_s: Array
    """Base axes."""
    tool_speed_m_s: float
    force_n: float
    pressed_s: float
    """For how long that force has been beyond its limit and tolerance."""
    external_nm: Array


def default_limits(arm: ArmConfig) -> SafetyLimits:
    """Return limits from the arm's file: ranges (the twin's elbow has half of UR's), full speed, force."""
    return SafetyLimits(
        q_min_rad=six([j.range_rad[0] for j in arm.joints]),
        q_max_rad=six([j.range_rad[1] for j in arm.joints]),
        speed_rad_s=six([j.speed_rad_s for j in arm.joints]),
        tool_force_n=arm.motion.force_limit_n,
        deviation_rad=arm.motion.tracking_error_rad,
    )


def breach_asked(limits: SafetyLimits, asked: Asked) -> Breach | None:
    """Return the first limit that a set-point passes, or None."""
    q, qd = asked.q_rad.tolist(), asked.qd_rad_s.tolist()
    is_plain = is_plainly_asked(six(q), six(qd), (limits.q_min_rad, limits.q_max_rad), limits.speed_rad_s)
    breach = None if is_plain else _joints_asked(limits, q, qd)
    return breach or _tool_asked(limits, asked)


def _joints_asked(limits: SafetyLimits, q: list[float], qd: list[float]) -> Breach | None:
    if not all(map(math.isfinite, q)):
        return Breach(cause=Cause.NOT_FINITE, text="target position is not a number; check what the program computes")
    speed = [abs(v) for v in qd]
    i = _first(v - most * JUMP_SPEEDS for v, most in zip(speed, limits.speed_rad_s, strict=True))
    if i is not None:
        jump = speed[i] * SLICE_S
        return _breach(Cause.JUMP, i, f"target jumped by {jump:.3f} rad in one slice; send nearer targets")
    i = _first(v - most * (1.0 + ROUNDING) for v, most in zip(speed, limits.speed_rad_s, strict=True))
    if i is not None:
        return _breach(Cause.TARGET_SPEED, i, f"target moves at {speed[i]:.2f} rad/s, beyond its limit")
    # Who stands beyond a limit may stand there and come back.
    ranges = zip(q, qd, limits.q_min_rad, limits.q_max_rad, strict=True)
    i = _first((x - high if v > 0.0 else low - x) if v else 0.0 for x, v, low, high in ranges)
    if i is not None:
        return _breach(Cause.JOINT_LIMIT, i, f"target {q[i]:.3f} rad is beyond the joint's limit")
    return None


def _tool_asked(limits: SafetyLimits, asked: Asked) -> Breach | None:
    tool_m_s = math.dist(asked.tool_m.tolist(), asked.tool_before_m.tolist()) / SLICE_S
    if not tool_m_s <= limits.tool_speed_m_s * (1.0 + ROUNDING):
        text = f"target moves the tool at {tool_m_s:.2f} m/s, limit {limits.tool_speed_m_s:.2f}"
        return Breach(cause=Cause.TARGET_TOOL_SPEED, text=text)
    if not limits.planes:
        return None
    leaving = tuple(p for p in limits.planes if float(np.dot(p.normal, asked.tool_m - asked.tool_before_m)) < 0.0)
    if _is_beyond(leaving, asked.tool_m, 0.0):
        return Breach(cause=Cause.PLANE, text="target position is beyond a safety plane")
    # Stopped any later the tool would come to rest beyond it.
    if any(_is_beyond(leaving, tool_m, 0.0) for tool_m in asked.tool_stop_m):
        return Breach(cause=Cause.PLANE, text="target moves too fast towards a safety plane to stop before it")
    return None


def breach_felt(limits: SafetyLimits, felt: Felt) -> Breach | None:
    """Return the first limit that a measurement passes, or None; violations come before protective stops.

    A force is no violation before it has lasted: its stop comes first.
    """
    return None if _is_plainly_felt(limits, felt) else _violation(limits, felt) or _collision(limits, felt)


def _is_plainly_felt(limits: SafetyLimits, felt: Felt) -> bool:
    """Return whether nothing is near a limit, tolerances aside; what is not may still be no breach."""
    if limits.planes or not (felt.tool_speed_m_s <= limits.tool_speed_m_s and felt.force_n <= limits.tool_force_n):
        return False
    return is_plainly_felt(
        six(felt.q_rad), six(felt.qd_rad_s), six(felt.q_expected_rad),
        six(felt.external_nm), (limits.q_min_rad, limits.q_max_rad),
        (limits.speed_rad_s, limits.collision_nm, limits.deviation_rad),
    )  # fmt: skip


def _violation(limits: SafetyLimits, felt: Felt) -> Breach | None:
    q = felt.q_rad.tolist()
    ranges = zip(q, felt.qd_rad_s.tolist(), limits.q_min_rad, limits.q_max_rad, strict=True)
    i = _first(_further(x, v, low, high) for x, v, low, high in ranges)
    if i is not None:
        return _breach(Cause.JOINT_VIOLATION, i, f"joint at {q[i]:.3f} rad is beyond its limit")
    too_fast = _too_fast(limits, felt, JOINT_RUNAWAY_RAD_S, Cause.JOINT_SPEED_VIOLATION)
    too_fast = too_fast or _tool_too_fast(limits, felt, TOOL_RUNAWAY_M_S, Cause.TOOL_SPEED_VIOLATION)
    if too_fast is not None:
        return too_fast
    further = [p for p in limits.planes if not float(np.dot(p.normal, felt.tool_velocity_m_s)) >= -FURTHER_M_S]
    if _is_beyond(further, felt.tool_m, PLANE_TOLERANCE_M):
        return Breach(cause=Cause.PLANE_VIOLATION, text="tool is beyond a safety plane")
    if felt.force_n > limits.tool_force_n + FORCE_TOLERANCE_N and felt.pressed_s >= PRESSED_S:
        text = f"force on the tool is {felt.force_n:.0f} N, limit {limits.tool_force_n:.0f}"
        return Breach(cause=Cause.FORCE_VIOLATION, text=text)
    return None


def is_outside(limits: SafetyLimits, q_rad: Array, tool_m: Array) -> bool:
    """Return whether the arm is beyond a joint's limit or a plane, and its tolerance: then only a person moves it.

    (6,), (3,)
    """
    q = q_rad.tolist()
    if not limits.planes and all(map(le, limits.q_min_rad, q)) and all(map(le, q, limits.q_max_rad)):
        return False
    ranges = zip(q, limits.q_min_rad, limits.q_max_rad, strict=True)
    beyond = (max(x - high, low - x) - JOINT_TOLERANCE_RAD for x, low, high in ranges)
    return _first(beyond) is not None or _is_beyond(limits.planes, tool_m, PLANE_TOLERANCE_M)


def _further(x: float, v: float, low: float, high: float) -> float:
    """Return how far a joint that goes on is beyond its limit and tolerance; not a number where one is none."""
    beyond = max(x - high, low - x) - JOINT_TOLERANCE_RAD
    is_back = v <= FURTHER_RAD_S if x > high else v >= -FURTHER_RAD_S
    return min(beyond, 0.0) if is_back else beyond


def _too_fast(limits: SafetyLimits, felt: Felt, tolerance_rad_s: float, cause: Cause) -> Breach | None:
    speed = [abs(v) for v in felt.qd_rad_s.tolist()]
    i = _first(v - most - tolerance_rad_s for v, most in zip(speed, limits.speed_rad_s, strict=True))
    return None if i is None else _breach(cause, i, f"joint turns at {speed[i]:.2f} rad/s, beyond its limit")


def _tool_too_fast(limits: SafetyLimits, felt: Felt, tolerance_m_s: float, cause: Cause) -> Breach | None:
    if felt.tool_speed_m_s <= limits.tool_speed_m_s + tolerance_m_s:
        return None
    return Breach(cause=cause, text=f"tool moves at {felt.tool_speed_m_s:.2f} m/s, limit {limits.tool_speed_m_s:.2f}")


def _collision(limits: SafetyLimits, felt: Felt) -> Breach | None:
    too_fast = _too_fast(limits, felt, JOINT_SPEED_TOLERANCE_RAD_S, Cause.JOINT_SPEED)
    too_fast = too_fast or _tool_too_fast(limits, felt, SPEED_TOLERANCE_M_S, Cause.TOOL_SPEED)
    if too_fast is not None:
        return too_fast
    outside = [abs(v) for v in felt.external_nm.tolist()]
    i = _first(v - most for v, most in zip(outside, limits.collision_nm, strict=True))
    if i is not None:
        return _breach(Cause.JOINT_COLLISION, i, f"collision detected by joint: {outside[i]:.0f} Nm from outside")
    if felt.force_n > limits.tool_force_n:
        return Breach(cause=Cause.TOOL_COLLISION, text=f"collision detected at the tool: {felt.force_n:.0f} N")
    off = [abs(v) for v in (felt.q_expected_rad - felt.q_rad).tolist()]
    i = _first(v - limits.deviation_rad for v in off)
    if i is not None:
        return _breach(Cause.DEVIATION, i, f"position deviates from path by {off[i]:.3f} rad")
    return None


def _breach(cause: Cause, joint: int, text: str) -> Breach:
    return Breach(cause=cause, text=f"joint {joint}: {text}", joint=joint)


def _first(excess: Iterable[float]) -> int | None:
    """Return the first joint with more than nothing too much; what is not a number is too much.

    In plain floats, a third of what arrays of six cost.
    """
    for i, too_much in enumerate(excess):
        if not too_much <= 0.0:
            return i
    return None


def _is_beyond(planes: Sequence[Plane], tool_m: Array, tolerance: float) -> bool:
    return any(not float(np.dot(p.normal, tool_m)) >= p.offset_m - tolerance for p in planes)
