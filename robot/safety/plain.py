"""Whether a command is so plainly within its limits that no check of where it leads could refuse it. Pure, compiled.

A shortcut for nearly every tick, and no check itself: it may only be too strict. Whatever is not plain is asked check
by check, which also finds the words; whatever is plain passes each of them, and a property test holds it to that.
"""

import numpy as np

from robot.chain import Points, ToolChain, chain_points, lowest_fingertip
from robot.compiled import Table, compiled
from robot.envelope import Envelope
from robot.fences import least_gap
from robot.geometry import inside_box
from robot.messages import Vec3, Vec6
from robot.safety.limits import GateLimits

__all__ = ["Commands", "is_plain", "plain_bounds"]

Commands = tuple[Vec6, Vec6, Vec6, Vec6]
"""The command and the three before it, the newest first."""


def plain_bounds(limits: GateLimits, envelope: Envelope, chain: ToolChain) -> Table:
    """Return what `is_plain` holds a command to besides joints and fences.  () -> (7, 6)"""
    low, high = limits.workspace_m
    return np.array(
        [
            limits.q_min_rad,
            limits.q_max_rad,
            limits.joint_step_rad,
            (*low, *high),
            (*chain.tcp_m, *chain.elbow_m),
            (*envelope.part_step_m, chain.tip_m, chain.finger_m, limits.tip_min_m),
            (limits.tracking_error_rad, envelope.cone_cosine, 0.0, 0.0, 0.0, 0.0),
        ]
    )


@compiled
def _is_slow(to: Vec3, now: Vec3, most_m: float) -> bool:
    dx, dy, dz = to[0] - now[0], to[1] - now[1], to[2] - now[2]
    return dx * dx + dy * dy + dz * dz <= most_m * most_m


@compiled
def _are_joints_plain(commands: Commands, measured_rad: Vec6, bounds: Table, joints: Table) -> bool:
    """Return whether joints are outside their soft margins, follow, and change speed and acceleration little."""
    now, last, before, earlier = commands
    for i in range(6):
        q, step, was, rate = now[i], now[i] - last[i], last[i] - before[i], before[i] - earlier[i]
        margin, gain, jerk = joints[i, 2], min(joints[i, 4], joints[i, 6]), min(joints[i, 5], joints[i, 7])
        if not (
            max(bounds[0, i], joints[i, 0] + margin) <= q <= min(bounds[1, i], joints[i, 1] - margin)
            and abs(step) <= bounds[2, i]
            and abs(step - was) <= gain
            and abs(step - 2.0 * was + rate) <= jerk
            and abs(q - measured_rad[i]) <= bounds[6, 0]
        ):
            return False
    return True


@compiled
def is_plain(
    commands: Commands, measured_rad: Vec6, points: Points, rows: Table, bounds: Table, joints: Table, fences: Table
) -> tuple[bool, Points]:
    """Return whether a command is plainly within, and where it brings tool, flange and elbow.

    Args:
        commands: it, and those before.
        measured_rad: where the arm is.
        points: where the command before brought them.
        rows: the chain's, robot.chain.
        bounds: plain_bounds.
        joints: the envelope's.
        fences: likewise.
    """
    b = bounds
    tcp_m, elbow_m = (b[4, 0], b[4, 1], b[4, 2]), (b[4, 3], b[4, 4], b[4, 5])
    there, down = chain_points(commands[0], rows, tcp_m, elbow_m)
    lowest_m = lowest_fingertip(there[0], down, b[5, 3], b[5, 4])
    low_m, high_m = (b[3, 0], b[3, 1], b[3, 2]), (b[3, 3], b[3, 4], b[3, 5])
    is_within = (
        _are_joints_plain(commands, measured_rad, b, joints)
        and inside_box(there[0], low_m, high_m)
        and lowest_m >= b[5, 5]
        and down >= b[6, 1]
        and _is_slow(there[0], points[0], b[5, 0])
        and _is_slow(there[1], points[1], b[5, 1])
        and _is_slow(there[2], points[2], b[5, 2])
        and least_gap(fences, there) >= 0.0
    )
    return is_within, there
