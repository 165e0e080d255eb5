"""All that the gate asks of a moving command's numbers, in one call: nearly every tick needs no more. Pure, compiled.

A shortcut and no check itself: it may only be too strict. What it does not pass is asked check by check, in their own
order, which also finds the words; what it passes, every check would have passed, and a property test holds it to that.
"""

import math

from robot.compiled import Table, compiled
from robot.messages import Vec3, Vec6
from robot.safety.cross_check import SHARE, SPEED_M_S, speed_of_tool
from robot.safety.plain import Commands, is_plain
from robot.safety.stop_check import looked_ahead

__all__ = ["FREE", "PLAIN", "UNSURE", "passed_at_once"]

UNSURE, PLAIN, FREE = 0, 1, 2
"""Nothing is said; all passes but the stop, which is to be looked at; the stop is free too."""
STRICT = 1.0 - 1e-9
"""More than roots and sums in another order can differ by."""


@compiled
def _are_speeds_one(q_rad: Vec6, qd_rad_s: Vec6, reported_m_s: Vec3, rows: Table, tcp_m: Vec3) -> bool:
    """Return whether the controller's speed of the tool is ours, within what cross_check allows."""
    x, y, z = speed_of_tool(q_rad, qd_rad_s, rows, tcp_m)
    dx, dy, dz = x - reported_m_s[0], y - reported_m_s[1], z - reported_m_s[2]
    most_m_s = SPEED_M_S + SHARE * math.sqrt(x * x + y * y + z * z)
    return math.sqrt(dx * dx + dy * dy + dz * dz) <= STRICT * most_m_s


@compiled
def passed_at_once(
    commands: Commands,
    measured: tuple[Vec6, Vec6],
    tool_m_s: Vec3,
    memory: Table,
    known: Table,
    seen: Table,
    stop: Table,
    rows: Table,
    bounds: Table,
    joints: Table,
    fences: Table,
) -> int:
    """Return UNSURE, PLAIN or FREE for a command that is finite and not the same as the last.

    Args:
        commands: it, and the three before.
        measured: joints and their speeds.
        tool_m_s: the tool's speed as the controller tells it.
        memory: (1, 9) where the last command brought the parts; unless UNSURE, where this one does from now on.
        known: StopCheck.known, kept up where FREE.
        seen: StopCheck.seen.
        stop: StopCheck.law.
        rows: the chain's, robot.chain.
        bounds: plain_bounds.
        joints: the envelope's.
        fences: likewise.
    """
    q_rad, qd_rad_s = measured
    m, b = memory, bounds
    tcp_m = (b[4, 0], b[4, 1], b[4, 2])
    if not _are_speeds_one(q_rad, qd_rad_s, tool_m_s, rows, tcp_m):
        return UNSURE
    before = (m[0, 0], m[0, 1], m[0, 2]), (m[0, 3], m[0, 4], m[0, 5]), (m[0, 6], m[0, 7], m[0, 8])
    is_within, there = is_plain(commands, q_rad, before, rows, bounds, joints, fences)
    if not is_within:
        return UNSURE
    for part in range(3):
        for axis in range(3):
            m[0, 3 * part + axis] = there[part][axis]
    far_m = (stop[0, 0], stop[0, 1], stop[0, 2], stop[0, 3], stop[0, 4], stop[0, 5])
    (fence_m, range_rad), is_limit_near, covered, _, _ = looked_ahead(
        commands[0], commands[1], (known[0, 0], known[0, 1]), seen, far_m,
        (stop[1, 0], stop[1, 1]), (stop[1, 2], stop[1, 3]),
    )  # fmt: skip
    if is_limit_near or not covered > 1.0:
        return PLAIN
    known[0, 0], known[0, 1] = fence_m, range_rad
    return FREE
