"""The gate's checks of a limits profile: pure functions that say None or why not. Joints are finite by then."""

import math
from collections.abc import Callable

from robot.envelope import SLOWEST_SHARE, Envelope
from robot.messages import Vec3, Vec6
from robot.safety.checks import Reason, Refusal

__all__ = [
    "Points",
    "check_cone",
    "check_fences",
    "check_giving_way",
    "check_joint_acceleration",
    "check_joint_jerk",
    "check_part_speeds",
    "check_soft_margin",
]

ROUNDING = 1e-9
"""Share of a step by which rounding may pass a limit."""
TINY_RAD = 1e-12
"""Angles of several radians are known to a few times 1e-16, their third differences to a hundred times less well."""
CREEP_RAD = 1e-6
"""A joint may come to its end by steps as small as this, from which it need not brake."""
PART_NAMES = ("tool centre point", "flange", "elbow")

Points = tuple[Vec3, Vec3, Vec3]


def check_soft_margin(q_rad: Vec6, last_rad: Vec6, envelope: Envelope) -> Refusal | None:
    """Refuse a joint that goes towards an end faster than its soft margin lets it, or than it could stop from.

    Away from an end any speed passes here.
    """
    for i, (q, last, end) in enumerate(zip(q_rad, last_rad, envelope.joints, strict=True)):
        if q - end.low_rad < end.margin_rad and q < last:
            gap, step = q - end.low_rad, last - q
        elif end.high_rad - q < end.margin_rad and q > last:
            gap, step = end.high_rad - q, q - last
        else:
            continue
        most = end.step_rad * (SLOWEST_SHARE + (1.0 - SLOWEST_SHARE) * gap / end.margin_rad)
        stops = step <= CREEP_RAD or step * step <= 2.0 * end.gain_rad * gap
        if not (stops and step <= most * (1.0 + ROUNDING)):
            detail = (
                f"joint {i + 1}: expected at most {most:g} rad a tick towards an end {gap:g} rad away, came {step:g}"
            )
            return Refusal(Reason.SOFT_MARGIN, detail, abs(step - most))
    return None


def check_joint_acceleration(q_rad: Vec6, last_rad: Vec6, before_rad: Vec6, envelope: Envelope) -> Refusal | None:
    """Refuse a joint that gathers speed faster than its acceleration, or changes it faster than a stop's.

    One that turns round gathers what it has after the turn.

    Args:
        q_rad: the command.
        last_rad: the command before.
        before_rad: the one before that.
        envelope: how much their speed may change.
    """
    for i, end in enumerate(envelope.joints):
        last, step = last_rad[i] - before_rad[i], q_rad[i] - last_rad[i]
        gain = abs(step) - (abs(last) if (step < 0.0) == (last < 0.0) else 0.0)
        if not gain <= end.gain_rad * (1.0 + ROUNDING):
            detail = (
                f"joint {i + 1}: expected a gain of at most {end.gain_rad:g} rad on the step {last:g}, came {step:g}"
            )
            return Refusal(Reason.JOINT_ACCELERATION, detail, gain - end.gain_rad)
        if not abs(step - last) <= end.stop_rad * (1.0 + ROUNDING):
            detail = f"joint {i + 1}: expected a step within {end.stop_rad:g} rad of the last, {last:g}, came {step:g}"
            return Refusal(Reason.JOINT_ACCELERATION, detail, abs(step - last) - end.stop_rad)
    return None


def check_joint_jerk(
    q_rad: Vec6, last_rad: Vec6, before_rad: Vec6, earlier_rad: Vec6, envelope: Envelope
) -> Refusal | None:
    """Refuse a joint that gathers speed ever faster by more than its jerk, or changes its acceleration by a stop's.

    What let go of a brake gathers speed from there; what turns round does so from the next tick on.

    Args:
        q_rad: the command.
        last_rad: the command before.
        before_rad: the one before that.
        earlier_rad: and the one before that.
        envelope: how much their acceleration may change.
    """
    for i, end in enumerate(envelope.joints):
        step, last = q_rad[i] - last_rad[i], last_rad[i] - before_rad[i]
        rate, now = last - before_rad[i] + earlier_rad[i], step - last
        most = end.stop_jerk_rad
        if not abs(now - rate) <= most * (1.0 + ROUNDING):
            detail = f"joint {i + 1}: expected steps to change within {most:g} rad of {rate:g}, they did by {now:g}"
            return Refusal(Reason.JOINT_JERK, detail, abs(now - rate) - most)
        if now < 0.0:
            step, last, rate, now = -step, -last, -rate, -now
        gained, most = rate if rate > 0.0 else 0.0, end.jerk_rad
        grown = now - gained
        if step > 0.0 and last >= 0.0 and not grown <= most * (1.0 + ROUNDING) + TINY_RAD:
            detail = f"joint {i + 1}: expected a gain at most {most:g} rad beyond the last, {gained:g}, came {now:g}"
            return Refusal(Reason.JOINT_JERK, detail, grown - most)
    return None


def check_giving_way(
    q_rad: Vec6, last_rad: Vec6, before_rad: Vec6, measured_rad: Vec6, envelope: Envelope
) -> Refusal | None:
    """Refuse a joint whose command gains more than its acceleration allows, but for what gives way to a push.

    Losing speed without turning round, and coming nearer to where the arm is measured, may then be as hard as they
    will: the push is harder than either.

    Args:
        q_rad: the command.
        last_rad: the command before.
        before_rad: the one before that.
        measured_rad: where the arm is that something pushes.
        envelope: how much their speed may change.
    """
    for i, end in enumerate(envelope.joints):
        last, step, most = last_rad[i] - before_rad[i], q_rad[i] - last_rad[i], end.gain_rad
        back = measured_rad[i] - last_rad[i]
        over = max(step - max(0.0, last, back), min(0.0, last, back) - step)
        if not over <= most:
            detail = f"joint {i + 1}: expected a step within {most:g} rad of the last, {last:g}, came {step:g}"
            return Refusal(Reason.JOINT_ACCELERATION, detail, over - most)
    return None


def check_part_speeds(
    now: Points, last: Points, measured: Callable[[], Points] | None, envelope: Envelope
) -> Refusal | None:
    """Refuse a tool centre point, flange or elbow that would go further in one tick than its speed allows.

    One that comes nearer to where it is measured, while something holds it, gives way and may do so at once.

    Args:
        now: the parts for the command.
        last: the parts for the command before.
        measured: where they are, if something pushes the arm; asked only where a part is too fast.
        envelope: how far they may go.
    """
    for i, most in enumerate(envelope.part_step_m):
        (x, y, z), (u, v, w) = now[i], last[i]
        dx, dy, dz = x - u, y - v, z - w
        if not dx * dx + dy * dy + dz * dz <= most * most:
            if measured is not None:
                is_at = measured()[i]
                if math.dist(now[i], is_at) <= math.dist(last[i], is_at):
                    continue
            way = math.dist(now[i], last[i])
            detail = f"{PART_NAMES[i]}: expected at most {most:g} m a tick, came {way:g}"
            return Refusal(Reason.PART_SPEED, detail, way - most)
    return None


def check_fences(points: Points, envelope: Envelope) -> Refusal | None:
    """Refuse a point outside of a box or plane that fences it in, or inside of a volume that it is kept out of."""
    for fence in envelope.fences:
        gap = fence.gap(points[fence.part])
        if not gap >= 0.0:
            detail = f"{fence.name}: expected the {PART_NAMES[fence.part]} on its allowed side, came {-gap:g} m beyond"
            return Refusal(Reason.FENCE, detail, -gap)
    return None


def check_cone(down: float, envelope: Envelope) -> Refusal | None:
    """Refuse a tool that points further away from straight down than its cone.

    Args:
        down: cosine of the angle between the tool's approach axis and straight down.
        envelope: how far it may be away.
    """
    if down >= envelope.cone_cosine:
        return None
    detail = f"expected the tool within {envelope.cone_rad:g} rad of straight down, came a cosine of {down:g}"
    return Refusal(Reason.CONE, detail, envelope.cone_cosine - down)
