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
    "check_joint_acceleration",
    "check_part_speeds",
    "check_soft_margin",
]

ROUNDING = 1e-9
"""Share of a step by which rounding may pass a limit."""
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
        stops = step <= CREEP_RAD or step * step <= 2.0 * end.braking_rad * gap
        if not (stops and step <= most * (1.0 + ROUNDING)):
            detail = (
                f"joint {i + 1}: expected at most {most:g} rad a tick towards an end {gap:g} rad away, came {step:g}"
            )
            return Refusal(Reason.SOFT_MARGIN, detail, abs(step - most))
    return None


def check_joint_acceleration(
    q_rad: Vec6, last_rad: Vec6, before_rad: Vec6, measured_rad: Vec6 | None, envelope: Envelope
) -> Refusal | None:
    """Refuse a joint whose command changes its speed by more than its acceleration allows in one tick.

    Losing speed without turning round, and giving way to where the arm is measured while something holds it, may be as
    hard as they will: a stop brakes so, and a command that something pushed back.

    Args:
        q_rad: the command.
        last_rad: the command before.
        before_rad: the one before that.
        measured_rad: where the arm is, if something pushes it; None where nothing does.
        envelope: how much their speed may change.
    """
    for i, end in enumerate(envelope.joints):
        last, step, most = last_rad[i] - before_rad[i], q_rad[i] - last_rad[i], end.braking_rad
        if abs(step - last) <= most:
            continue
        back = 0.0 if measured_rad is None else measured_rad[i] - last_rad[i]
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
