"""The gate's checks: pure functions that say None or why not. Finiteness is the first of them."""

import math
from enum import StrEnum

import msgspec

from robot.compiled import compiled
from robot.geometry import inside_box
from robot.messages import (
    ArmCommand,
    ArmMode,
    ArmState,
    Grip,
    Heading,
    Hold,
    JointTarget,
    Twist,
    Vec3,
    Vec6,
)
from robot.safety.limits import GateLimits

__all__ = [
    "Reason",
    "Refusal",
    "check_finite",
    "check_force",
    "check_grip",
    "check_intent",
    "check_intent_age",
    "check_joint_range",
    "check_joint_speed",
    "check_outputs",
    "check_percept_age",
    "check_push",
    "check_sequence",
    "check_state",
    "check_tool",
    "check_tracking",
]

N_JOINTS = 6
REASON_M, REASON_RAD, REASON_M_S = 10.0, 1e3, 10.0
"""An intent beyond these is not large but wrong."""
_INTENTS = (Heading, Twist, JointTarget, Hold)
_MOST_HEADING = (REASON_RAD, REASON_M, REASON_M)
_MOST_TWIST = (*(REASON_M_S,) * 3, *(REASON_RAD,) * 3)
_MOST_JOINTS = (REASON_RAD,) * N_JOINTS


class Reason(StrEnum):
    """Why something was refused."""

    MALFORMED = "malformed"
    NOT_FINITE = "not_finite"
    OUT_OF_REASON = "out_of_reason"
    SEQUENCE = "sequence"
    STALE_STATE = "stale_state"
    ARM_REFUSED = "arm_refused"
    WIRE = "wire"
    STALE_INTENT = "stale_intent"
    STALE_PERCEPT = "stale_percept"
    STOP = "stop"
    ARM_MODE = "arm_mode"
    JOINT_RANGE = "joint_range"
    JOINT_SPEED = "joint_speed"
    SOFT_MARGIN = "soft_margin"
    JOINT_ACCELERATION = "joint_acceleration"
    JOINT_JERK = "joint_jerk"
    PART_SPEED = "part_speed"
    FENCE = "fence"
    CONE = "cone"
    WORKSPACE = "workspace"
    TABLE = "table"
    TRACKING = "tracking"
    FORCE = "force"
    GRIP = "grip"
    OUTPUTS = "outputs"
    CLEARANCE = "clearance"
    STOP_RANGE = "stop_range"
    STOP_WORKSPACE = "stop_workspace"
    KINEMATICS = "kinematics"
    PAYLOAD = "payload"


class Refusal(msgspec.Struct, frozen=True):
    """Why not, what was expected and what came, and by how much it was too much (in the check's own unit)."""

    reason: Reason
    detail: str
    amount: float = 0.0


def check_intent(intent: object) -> Refusal | None:
    """Refuse what is no intent, is not finite or cannot be meant. Large but meant intents are shaped, not refused."""
    if not isinstance(intent, _INTENTS):
        return Refusal(Reason.MALFORMED, f"expected Heading, Twist, JointTarget or Hold, came {type(intent).__name__}")
    if not (intent.grip is None or isinstance(intent.grip, Grip)):
        return Refusal(Reason.MALFORMED, f"expected grip open, close or nothing, came {intent.grip!r}")
    try:
        return _check_intent_values(intent)
    except (TypeError, ValueError) as error:
        return Refusal(Reason.MALFORMED, f"expected numbers in {type(intent).__name__}: {error}")


def _check_intent_values(intent: Heading | Twist | JointTarget | Hold) -> Refusal | None:
    if isinstance(intent, Heading):
        values, most = (intent.heading_rad, intent.distance_m, intent.height_m), _MOST_HEADING
    elif isinstance(intent, Twist):
        values, most = (*intent.linear_m_s, *intent.angular_rad_s), _MOST_TWIST
    elif isinstance(intent, JointTarget):
        values, most = tuple(intent.q_rad), _MOST_JOINTS
    else:
        return None
    if len(values) != len(most):
        return Refusal(Reason.MALFORMED, f"expected {len(most)} numbers in {type(intent).__name__}, came {len(values)}")
    if not all(map(math.isfinite, values)):
        return Refusal(Reason.NOT_FINITE, f"expected finite numbers in {type(intent).__name__}, came {values}")
    for value, limit in zip(values, most, strict=True):
        if abs(value) > limit:
            return Refusal(Reason.OUT_OF_REASON, f"expected at most {limit:g}, came {value:g}", abs(value) - limit)
    if isinstance(intent, Heading) and intent.distance_m < 0.0:
        return Refusal(Reason.OUT_OF_REASON, f"expected a distance of 0 or more, came {intent.distance_m:g} m")
    return None


def check_finite(command: ArmCommand) -> Refusal | None:
    """Refuse a command with anything but six finite joints, a finite grip and an integer of outputs."""
    grip = command.grip
    try:
        if len(command.q_rad) != N_JOINTS:
            return Refusal(Reason.MALFORMED, f"expected {N_JOINTS} joints, came {len(command.q_rad)}")
        # A sum is finite only if every term is: infinities of opposite sign make NaN.
        if not math.isfinite(sum(command.q_rad) + grip.opening_m + grip.force_n + grip.speed_m_s):
            return Refusal(Reason.NOT_FINITE, f"expected finite joints and grip, came {command.q_rad}, {grip}")
    except (TypeError, AttributeError) as error:
        return Refusal(Reason.MALFORMED, f"expected numbers in the command: {error}")
    if type(command.digital_out) is not int:
        return Refusal(Reason.MALFORMED, f"expected outputs as bits, came {command.digital_out!r}")
    return None


def check_sequence(command: ArmCommand, previous: int) -> Refusal | None:
    """Refuse a command that is not the one after the last."""
    if command.sequence == previous + 1:
        return None
    return Refusal(Reason.SEQUENCE, f"expected command {previous + 1}, came {command.sequence}")


def check_state(state: ArmState, command: ArmCommand, now_ns: int, limits: GateLimits) -> Refusal | None:
    """Refuse to act on an old or future measurement, with an old command, or on an arm that does not run."""
    oldest = now_ns - limits.state_max_age_ns
    if not oldest <= state.stamp_ns <= now_ns:
        return _stale("state", state.stamp_ns, now_ns, limits)
    if not oldest <= command.stamp_ns <= now_ns:
        return _stale("command", command.stamp_ns, now_ns, limits)
    if state.mode is not ArmMode.RUNNING:
        return Refusal(Reason.ARM_MODE, f"expected a running arm, it is {state.mode}")
    return None


def _stale(what: str, stamp_ns: int, now_ns: int, limits: GateLimits) -> Refusal:
    age_ms, most_ms = (now_ns - stamp_ns) / 1e6, limits.state_max_age_ns / 1e6
    return Refusal(Reason.STALE_STATE, f"expected a {what} of 0 to {most_ms:g} ms, came {age_ms:g} ms", age_ms / 1e3)


def check_intent_age(intent_ns: int, now_ns: int, limits: GateLimits) -> Refusal | None:
    """Refuse motion long after the last intent."""
    age_ns = now_ns - intent_ns
    if 0 <= age_ns <= limits.intent_max_age_ns:
        return None
    most_s = limits.intent_max_age_ns / 1e9
    return Refusal(
        Reason.STALE_INTENT, f"expected rest {most_s:g} s after an intent, came motion at {age_ns / 1e9:g} s"
    )


@compiled
def joint_out_of_range(q_rad: Vec6, low_rad: Vec6, high_rad: Vec6) -> int:
    """Return the first joint outside its range, -1 where none is."""
    for i in range(N_JOINTS):
        if not low_rad[i] <= q_rad[i] <= high_rad[i]:
            return i
    return -1


@compiled
def joint_too_far(a_rad: Vec6, b_rad: Vec6, most_rad: Vec6) -> int:
    """Return the first joint of which two angles are farther apart than they may be, -1 where none is."""
    for i in range(N_JOINTS):
        if not abs(a_rad[i] - b_rad[i]) <= most_rad[i]:
            return i
    return -1


def check_percept_age(percept_ns: int | None, now_ns: int, limits: GateLimits) -> Refusal | None:
    """Refuse motion long after the last percept, or with one of the future; None where nobody perceives."""
    if percept_ns is None or 0 <= now_ns - percept_ns <= limits.percept_max_age_ns:
        return None
    most_s, age_s = limits.percept_max_age_ns / 1e9, (now_ns - percept_ns) / 1e9
    return Refusal(Reason.STALE_PERCEPT, f"expected rest {most_s:g} s after a percept, came motion at {age_s:g} s")


def check_joint_range(q_rad: Vec6, limits: GateLimits) -> Refusal | None:
    """Refuse a joint outside its range."""
    i = joint_out_of_range(q_rad, limits.q_min_rad, limits.q_max_rad)
    if i < 0:
        return None
    low, q, high = limits.q_min_rad[i], q_rad[i], limits.q_max_rad[i]
    detail = f"joint {i + 1}: expected {low:g} to {high:g} rad, came {q:g}"
    return Refusal(Reason.JOINT_RANGE, detail, max(low - q, q - high))


def check_joint_speed(q_rad: Vec6, previous_rad: Vec6, limits: GateLimits) -> Refusal | None:
    """Refuse a joint that would move further in one tick than its speed allows."""
    i = joint_too_far(q_rad, previous_rad, limits.joint_step_rad)
    if i < 0:
        return None
    step, most = q_rad[i] - previous_rad[i], limits.joint_step_rad[i]
    detail = f"joint {i + 1}: expected a change of at most {most:g} rad a tick, came {step:g}"
    return Refusal(Reason.JOINT_SPEED, detail, abs(step) - most)


def check_tool(tcp: Vec3, lowest_m: float, limits: GateLimits) -> Refusal | None:
    """Refuse a tool centre point out of the workspace, or a fingertip too near the table.

    Args:
        tcp: where the command brings the tool centre point, base frame, metres.
        lowest_m: how high the lowest fingertip is then.
        limits: where they may be.
    """
    low, high = limits.workspace_m
    if not inside_box(tcp, low, high):
        by = max(max(a - x, x - b) for a, x, b in zip(low, tcp, high, strict=True))
        return Refusal(Reason.WORKSPACE, f"expected the tool within {low} to {high} m, came {_round(tcp)}", by)
    if not lowest_m >= limits.tip_min_m:
        detail = f"expected fingertips at {limits.tip_min_m:g} m or higher, came {lowest_m:g}"
        return Refusal(Reason.TABLE, detail, limits.tip_min_m - lowest_m)
    return None


def check_tracking(q_rad: Vec6, measured_rad: Vec6, limits: GateLimits) -> Refusal | None:
    """Refuse when the measured joints do not follow, or are not finite."""
    most = limits.tracking_error_rad
    i = joint_too_far(q_rad, measured_rad, (most, most, most, most, most, most))
    if i < 0:
        return None
    off = measured_rad[i] - q_rad[i]
    return Refusal(Reason.TRACKING, f"joint {i + 1}: expected it within {most:g} rad, came {off:g}", abs(off) - most)


def check_force(force_n: float, force_before_n: float, limits: GateLimits) -> Refusal | None:
    """Refuse when the tool is pushed too hard for longer than a tick, at once at the limit for impacts, or by NaN.

    The force guard of motion needs one tick to give way, so that a blow may exceed the limit for steady force once.
    """
    if force_n <= limits.force_max_n:
        return None
    if force_n <= limits.impact_max_n and force_before_n <= limits.force_max_n:
        return None
    detail = (
        f"expected at most {limits.force_max_n:g} N on the tool ({limits.impact_max_n:g} in a blow), came {force_n:g}"
    )
    return Refusal(Reason.FORCE, detail, force_n - limits.force_max_n)


def check_push(force_n: Vec3, before_n: float, step_m: Vec3, limits: GateLimits) -> Refusal | None:
    """Refuse to press on where a push that lasts would be harder than it may be by the end of the tick.

    What gives way, or holds still, does not press on. What presses from the side counts beside what presses upright:
    between two leaves of a lid a wrist felt 48 N of the 65 of both.

    Args:
        force_n: force of the world on the tool.
        before_n: how much it was a tick ago: up to the contact force there was no push yet, but a blow perhaps.
        step_m: where the command moves the tool centre point.
        limits: the forces that may be.
    """
    (x, y, z), now_n = force_n, math.hypot(*force_n)
    pressed_n = math.hypot(x, y) + abs(z)
    ahead_n = pressed_n + max(0.0, now_n - before_n)
    if before_n <= limits.contact_n or ahead_n <= limits.force_max_n:
        return None
    if sum([f * s for f, s in zip(force_n, step_m, strict=True)]) >= 0.0:
        return None
    detail = f"expected at most {limits.force_max_n:g} N on the tool by the next tick, it presses on at {pressed_n:g}"
    return Refusal(Reason.FORCE, detail, ahead_n - limits.force_max_n)


def check_grip(command: ArmCommand, limits: GateLimits) -> Refusal | None:
    """Refuse an opening, force or speed that the hand does not have."""
    grip = command.grip
    for name, value, (low, high) in (
        ("opening_m", grip.opening_m, limits.opening_m),
        ("force_n", grip.force_n, limits.grip_force_n),
        ("speed_m_s", grip.speed_m_s, limits.grip_speed_m_s),
    ):
        if not low <= value <= high:
            detail = f"grip.{name}: expected {low:g} to {high:g}, came {value:g}"
            return Refusal(Reason.GRIP, detail, max(low - value, value - high))
    return None


def check_outputs(command: ArmCommand, limits: GateLimits) -> Refusal | None:
    """Refuse outputs that the arm does not have."""
    stray = command.digital_out & ~limits.output_mask
    if not stray:
        return None
    return Refusal(Reason.OUTPUTS, f"expected bits within {limits.output_mask:#x}, came {command.digital_out:#x}")


def _round(point: tuple[float, float, float]) -> tuple[float, ...]:
    return tuple(round(x, 4) for x in point)
