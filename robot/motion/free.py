"""Whether a step of motion is so far from every limit that nothing could hold it back. Pure, compiled.

A shortcut for nearly every tick: it may only be too strict. What is not free is looked at limit by limit (holding,
pacing), and what is free they would leave as it is; a property test holds it to that.
"""

import math

import numpy as np

from robot.chain import Points, ToolChain, chain_points, lowest_fingertip
from robot.compiled import Table, compiled
from robot.envelope import Envelope, braking_step
from robot.fences import fence_gap, least_gap, row_of
from robot.geometry import between
from robot.messages import Vec3, Vec6
from robot.motion.holding import JOINT_RESERVE, MARGIN_M, OVERRUN_M, SPEED_RESERVE, braked_step
from robot.motion.pacing import RESERVE
from robot.motion.swinging import swing_step

__all__ = ["Steps", "free_bounds", "is_free_step"]

Steps = tuple[Vec6, Vec6, Vec6, Vec6]
"""The joints that are wanted and the three commands before, the newest first."""
Place = tuple[Points, float]
"""Points and the cosine of the tilt, as chain.ToolChain.points returns them."""


def free_bounds(envelope: Envelope, chain: ToolChain, *, tip_min_m: float) -> Table:
    """Return what `is_free_step` holds a step to besides joints and fences: fingertips to a height.  () -> (3, 6)"""
    held = (envelope.overshoot, envelope.cone_near_cosine, braked_step(envelope))
    return np.array(
        [
            (*chain.tcp_m, *chain.elbow_m),
            (*envelope.part_step_m, envelope.fence_far_m, envelope.fence_braking_m, envelope.onset),
            (*held, chain.tip_m, chain.finger_m, tip_min_m),
        ]
    )


@compiled
def _greatest_step(steps: Steps, joints: Table) -> float:
    """Return how far the joint goes that goes farthest; not a number where one is near any limit of its own."""
    wanted, now, before, earlier = steps
    fastest = 0.0
    for i in range(6):
        step, was, rate = wanted[i] - now[i], now[i] - before[i], before[i] - earlier[i]
        size = abs(step)
        if not (
            abs(step - was) <= RESERVE * min(joints[i, 4], joints[i, 6])
            and abs(step - 2.0 * was + rate) <= RESERVE * min(joints[i, 5], joints[i, 7])
            and size <= JOINT_RESERVE * joints[i, 3]
        ):
            return math.nan
        fastest = max(fastest, size)
    return fastest


@compiled
def _are_ends_far(steps: Steps, joints: Table, bounds: Table, fastest: float) -> bool:
    """Return whether every joint could brake, with all the others, before its soft margin at either end."""
    wanted, now, _, _ = steps
    stretch = 1.0 + bounds[1, 5] + fastest / bounds[2, 2]
    for i in range(6):
        far = joints[i, 2] + abs(wanted[i] - now[i]) * stretch
        if not joints[i, 0] + far <= now[i] <= joints[i, 1] - far:
            return False
    return True


@compiled
def _way(a: Vec3, b: Vec3) -> float:
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@compiled
def _are_parts_slow(before: Points, now: Points, to: Points, bounds: Table) -> bool:
    for i in range(3):
        size, most = _way(now[i], to[i]), SPEED_RESERVE * bounds[1, i]
        if not size <= most - bounds[2, 0] * max(0.0, size - _way(before[i], now[i])):
            return False
    return True


@compiled
def _are_swings_slow(now: Points, to: Points, past: tuple[Points, Points], bounds: Table) -> bool:
    for i in range(3):
        most = SPEED_RESERVE * bounds[1, i]
        if not _way(now[i], to[i]) <= swing_step(now[i], to[i], (past[0][i], past[1][i]), most):
            return False
    return True


@compiled
def _can_stop(now: float, to: float, end: float, bounds: Table, lost: float, onwards: float) -> bool:
    """Return whether a gap suffices to come to rest in, as holding reckons it.

    Args:
        now: what is left of it at the last command, motion's margin taken off.
        to: where the step leads.
        end: where joints that brake together would come to rest.
        bounds: free_bounds.
        lost: share of every step that braking takes off in a tick.
        onwards: how many steps such an arm goes.
    """
    size = max(now - to, (now - end) / onwards)
    return size <= 0.0 or size <= braking_step(now, min(bounds[1, 4], lost * size), bounds[1, 5])


@compiled
def _are_fences_far(
    now: Points, to: Points, end: Points, fences: Table, bounds: Table, lost: float, onwards: float
) -> bool:
    for k in range(fences.shape[0]):
        part, row = int(fences[k, 0]), row_of(fences, k)
        left = fence_gap(row, to[part])
        if left > bounds[1, 3]:
            continue
        here, rest = fence_gap(row, now[part]), fence_gap(row, end[part])
        if not _can_stop(here - MARGIN_M, left - MARGIN_M, rest - MARGIN_M, bounds, lost, onwards):
            return False
    return True


@compiled
def _are_tips_high(now: Place, to: Place, end: Place, bounds: Table, lost: float, onwards: float) -> bool:
    tip_m, finger_m, floor_m = bounds[2, 3], bounds[2, 4], bounds[2, 5] + MARGIN_M
    here = lowest_fingertip(now[0][0], now[1], tip_m, finger_m) - floor_m
    there = lowest_fingertip(to[0][0], to[1], tip_m, finger_m) - floor_m
    rest = lowest_fingertip(end[0][0], end[1], tip_m, finger_m) - floor_m
    return _can_stop(here, there, rest, bounds, lost, onwards)


@compiled
def _is_rest_inside(end: Place, fences: Table, bounds: Table, least_m: float) -> bool:
    """Return whether a stop at the worst ends inside of every fence, and its fingertips over the table."""
    lowest_m = lowest_fingertip(end[0][0], end[1], bounds[2, 3], bounds[2, 4])
    return lowest_m - bounds[2, 5] >= least_m and least_gap(fences, end[0]) >= least_m


@compiled
def is_free_step(
    steps: Steps,
    before: Points,
    now: Place,
    past: tuple[Points, Points],
    rows: Table,
    bounds: Table,
    joints: Table,
    fences: Table,
    is_straight: bool,
) -> tuple[bool, Place]:
    """Return whether a step is free, and where it brings tool, flange and elbow.

    Args:
        steps: where it leads, and the commands before.
        before: where the command before the last brought them.
        now: where the last one did.
        past: where they were before and after the step SWING_S ago.
        rows: the chain's, robot.chain.
        bounds: free_bounds.
        joints: the envelope's.
        fences: likewise.
        is_straight: the tool goes straight; joints' ways bend, and near a fence it matters where they would stop.
    """
    b = bounds
    tcp_m, elbow_m = (b[0, 0], b[0, 1], b[0, 2]), (b[0, 3], b[0, 4], b[0, 5])
    to = chain_points(steps[0], rows, tcp_m, elbow_m)
    fastest = _greatest_step(steps, joints)
    if not fastest > 0.0:
        return False, to
    is_free = (
        _are_ends_far(steps, joints, b, fastest)
        and _are_parts_slow(before, now[0], to[0], b)
        and _are_swings_slow(now[0], to[0], past, b)
        and (to[1] >= b[2, 1] or to[1] >= now[1])
    )
    if not is_free:
        return False, to
    lost = b[2, 2] / fastest
    onwards = 1.0 + b[1, 5] + 0.5 / lost
    end = chain_points(between(steps[1], steps[0], onwards), rows, tcp_m, elbow_m)
    if not _is_rest_inside(end, fences, b, -OVERRUN_M if is_straight else MARGIN_M):
        return False, to
    if is_straight:
        return _are_fences_far(now[0], to[0], to[0], fences, b, lost, 1.0), to
    is_free = _are_tips_high(now, to, end, b, lost, onwards) and _are_fences_far(
        now[0], to[0], end[0], fences, b, lost, onwards
    )
    return is_free, to
