"""Whether a slice is plainly within its limits, compiled: nearly every slice is, and 500 are judged a second.

Who is plain has no breach. Who is not is looked at limit by limit (sim_twin.controller.motion.limits).
"""

from robot.compiled import compiled
from robot.messages import Vec6

__all__ = ["is_plainly_asked", "is_plainly_felt"]

Range = tuple[Vec6, Vec6]
"""Least and greatest angles, rad."""


@compiled
def is_plainly_asked(q: Vec6, qd: Vec6, ranges: Range, fastest: Vec6) -> bool:
    """Return whether joints are inside their ranges and no faster than they may be; what is no number is not."""
    low, high = ranges
    is_plain = True
    for k in range(6):
        is_plain = is_plain and low[k] <= q[k] <= high[k] and abs(qd[k]) <= fastest[k]
    return is_plain


@compiled
def is_plainly_felt(
    q: Vec6, qd: Vec6, expected: Vec6, external_nm: Vec6, ranges: Range, most: tuple[Vec6, Vec6, float]
) -> bool:
    """Return whether measured joints are besides near where they should be, and nothing turns them from outside.

    Args:
        q: measured angles, rad.
        qd: and speeds, rad/s.
        expected: where the servos should have brought them, rad.
        external_nm: torque from contacts.
        ranges: least and greatest angles.
        most: greatest speeds, torques from outside, and deviation.
    """
    fastest, torque_nm, deviation_rad = most
    is_plain = is_plainly_asked(q, qd, ranges, fastest)
    for k in range(6):
        is_plain = is_plain and abs(expected[k] - q[k]) <= deviation_rad and abs(external_nm[k]) <= torque_nm[k]
    return is_plain
