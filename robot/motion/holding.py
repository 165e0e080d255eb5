"""How much of a step motion may take: held back ahead of every limit so that it can stop inside. Pure.

Only what goes towards a limit is held back, continuously: what goes away from it keeps its full speed. Each limit says
its name and by how much it held back, as a share of the step.
"""

import math

from robot.envelope import Envelope, braking_step, soft_step
from robot.messages import Vec3, Vec6

__all__ = ["MARGIN_M", "RESERVE", "Points", "share_of_giving_way", "share_of_step", "slid"]

MARGIN_M = 5e-4
"""Motion stops this far inside of a fence, so that the gate never meets one by rounding or by a path that bows."""
SLIDE_MARGIN_M = 1e-3
"""The tool slides along a fence at this distance, so that inverse kinematics' last digits never bring it to a stop."""
MARGIN_RAD = 1e-3
RESERVE = 0.95
"""Share of a limit that motion uses, so that the gate's own is never met by rounding."""
SPEED_RESERVE = 0.99
TILT_RAD_S2 = 5.0
"""Deceleration of the tool's tilt that is counted on ahead of its cone."""
PART_NAMES = ("tcp_speed", "flange_speed", "elbow_speed")

Points = tuple[Vec3, Vec3, Vec3]
Held = tuple[float, str]


def share_of_step(
    now_rad: Vec6, last_rad: Vec6, q_rad: Vec6, now: tuple[Points, float], to: tuple[Points, float], envelope: Envelope
) -> Held:
    """Return how much of the step to joints may be taken, 0 to 1, and what holds it back.

    Args:
        now_rad: the last command.
        last_rad: the one before.
        q_rad: the one that is wanted.
        now: points and tilt for the last command, as chain.ToolChain.points returns them.
        to: those for the one that is wanted.
        envelope: the limits.
    """
    share = _of_joints(now_rad, last_rad, q_rad, envelope)
    share = min(share, _of_speeds(now[0], to[0], envelope), _of_fences(now[0], to[0], envelope))
    return min(share, _of_cone(now[1], to[1], envelope))


def share_of_giving_way(now_rad: Vec6, last_rad: Vec6, q_rad: Vec6, measured_rad: Vec6, envelope: Envelope) -> float:
    """Return how much of a step that gives way to a push may be taken by the joints' accelerations, above 0 to 1.

    Braking, and coming nearer to where the arm is measured, cost nothing.
    """
    share = 1.0
    for now, last, q, at, end in zip(now_rad, last_rad, q_rad, measured_rad, envelope.joints, strict=True):
        step, before, back = q - now, now - last, at - now
        if step < 0.0:
            step, before, back = -step, -before, -back
        most = RESERVE * end.braking_rad + max(0.0, before, back)
        if step > most:
            share = min(share, most / step)
    return share


def _of_joints(now_rad: Vec6, last_rad: Vec6, q_rad: Vec6, envelope: Envelope) -> Held:
    best, name = 1.0, ""
    for now, last, q, end in zip(now_rad, last_rad, q_rad, envelope.joints, strict=True):
        step = q - now
        if step == 0.0:
            continue
        size, before = abs(step), now - last if step > 0.0 else last - now
        most = RESERVE * end.braking_rad + (before if before > 0.0 else 0.0)
        if size > most and most / size < best:
            best, name = most / size, "joint_acceleration"
        gap = end.high_rad - now if step > 0.0 else now - end.low_rad
        if gap - size < end.margin_rad:
            soft = RESERVE * soft_step(gap, end.margin_rad, end.step_rad)
            most = min(soft, braking_step(gap, RESERVE * RESERVE * end.braking_rad))
            if size > most and most / size < best:
                best, name = most / size, "soft_margin"
    return best, name


def _of_speeds(now: Points, to: Points, envelope: Envelope) -> Held:
    best, name = 1.0, ""
    for i, most in enumerate(envelope.part_step_m):
        (x, y, z), (u, v, w) = now[i], to[i]
        dx, dy, dz = u - x, v - y, w - z
        squared = dx * dx + dy * dy + dz * dz
        bound = SPEED_RESERVE * most
        if squared > bound * bound and bound / math.sqrt(squared) < best:
            best, name = bound / math.sqrt(squared), PART_NAMES[i]
    return best, name


def _of_fences(now: Points, to: Points, envelope: Envelope) -> Held:
    best, name = 1.0, ""
    for fence in envelope.fences:
        left = fence.gap(to[fence.part])
        if left > envelope.fence_far_m:
            continue
        gap = fence.gap(now[fence.part])
        size = gap - left
        if size <= 0.0:
            continue
        most = braking_step(gap - MARGIN_M, envelope.fence_braking_m)
        if size > most and most / size < best:
            best, name = most / size, fence.name
    return best, name


def _of_cone(down_now: float, down_to: float, envelope: Envelope) -> Held:
    if down_to >= envelope.cone_near_cosine or down_to >= down_now:
        return 1.0, ""
    tilt, left = _angle(down_now), _angle(down_to)
    size = left - tilt
    most = braking_step(envelope.cone_rad - MARGIN_RAD - tilt, TILT_RAD_S2 * envelope.tick_s * envelope.tick_s)
    return (most / size, "tool_cone") if size > most else (1.0, "")


def slid(now_m: Vec3, to_m: Vec3, envelope: Envelope) -> tuple[Vec3, str]:
    """Return where the tool centre point goes instead, along the fences that it would come too near too fast.

    Only the part of the step that goes towards a fence is taken away, so that the tool slides along it and around it.

    Args:
        now_m: where it is.
        to_m: where it would go in this tick.
        envelope: the fences.

    Returns:
        The place, and the name of the last fence that changed it, empty where none did.
    """
    name = ""
    for fence in envelope.fences:
        if fence.part or fence.gap(to_m) > envelope.fence_far_m:
            continue
        gap, left = fence.gap(now_m), fence.gap(to_m)
        over = gap - left - braking_step(gap - SLIDE_MARGIN_M, envelope.fence_braking_m)
        if over > 0.0 and left < gap:
            nx, ny, nz = fence.away(now_m)
            to_m = (to_m[0] + over * nx, to_m[1] + over * ny, to_m[2] + over * nz)
            name = fence.name
    return to_m, name


def _angle(cosine: float) -> float:
    return math.acos(max(-1.0, min(1.0, cosine)))
