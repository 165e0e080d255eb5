"""How far along a way gaps that were found before prove that nothing is too near. Pure maths, compiled.

A gap g at joints w bounds the gap at joints x by g - s(x - w), for nothing of the arm moves farther than the sweep s of
its turns. Along a straight way of joints the sweep from its beginning grows evenly up to the way's length L. So a gap
found at d from a place on the way keeps it free for (g - d) to either side of that place.
"""

import math

import numpy as np

from robot.compiled import Table, compiled
from robot.geometry import between, difference
from robot.messages import Vec6
from robot.safety.sweep import Links, swept_m

__all__ = ["N_SEEN", "covered_share", "nothing_seen"]

N_SEEN = 8
"""So many gaps are remembered, the newest: at the most two or three lie on a way, the others behind it."""


def nothing_seen() -> Table:
    """Return a memory of gaps without any: each row joints and the gap there.  () -> (N_SEEN, 7)"""
    seen = np.zeros((N_SEEN, 7))
    seen[:, 6] = -np.inf
    return seen


@compiled
def covered_share(q: Vec6, end: Vec6, length_m: float, seen: Table, far_m: Vec6, links_m: Links) -> float:
    """Return the share of a way, from its beginning on, on which gaps are above 0; more than 1 where they are on all.

    Args:
        q: where the way begins.
        end: where it ends.
        length_m: its sweep.
        seen: joints and the gap there, row by row.
        far_m: reaches of Sweep.
        links_m: the rest of them.
    """
    n = seen.shape[0]
    low, high = np.empty(3 * n), np.empty(3 * n)
    for k in range(n):
        at: Vec6 = (seen[k, 0], seen[k, 1], seen[k, 2], seen[k, 3], seen[k, 4], seen[k, 5])
        gap_m = seen[k, 6]
        from_q_m = swept_m(difference(at, q), far_m, links_m)
        from_end_m = swept_m(difference(at, end), far_m, links_m)
        both_m = from_q_m + from_end_m
        beside = from_q_m / both_m if both_m > 0.0 else 0.0
        beside_m = swept_m(difference(at, between(q, end, beside)), far_m, links_m)
        for i, (share, off_m) in enumerate(((0.0, from_q_m), (beside, beside_m), (1.0, from_end_m))):
            left_m = gap_m - off_m
            half = left_m / length_m if length_m > 0.0 else math.copysign(math.inf, left_m)
            low[3 * k + i], high[3 * k + i] = share - half, share + half
    reached, is_grown = 0.0, True
    while is_grown and reached <= 1.0:
        is_grown = False
        for i in range(3 * n):
            if low[i] < reached < high[i]:
                reached, is_grown = high[i], True
    return reached
