"""What comes to each conjunction from those one change apart: a literal more, one fewer, turned round, exchanged.

Two ways to the same sums. A table of neighbours is quick to look up while it is small. It grows with the fourth power
of the goals, so beyond LISTED conjunctions the sums are worked out from their common parts instead: with U(s) the sum
over all conjunctions of one literal more than s,

    arriving(c) = U(c) + sum over literals l of c of (leaving(c - l) + U(c - l) - leaving(c)),

for the conjunctions that exchange or turn round l are those of one literal more than c - l, without c itself. Both
agree but for rounding; the table is kept where it was, so that what was reported of smaller tables stays bit for bit.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

__all__ = ["LISTED", "Literals", "OneChange", "by_common_parts", "by_neighbours", "one_change"]

LISTED = 2000
"""Conjunctions up to which neighbours are listed: 12 goals of up to three literals have 1,563."""


class Literals(Protocol):
    """A conjunction, as bit masks."""

    @property
    def on(self) -> int:
        """Goals that must be on."""
        ...

    @property
    def off(self) -> int:
        """Goals that must be off."""
        ...


class OneChange:
    """Sums over neighbours.

    Args:
        n_changes: how many neighbours each conjunction has, at least 1.  (h,)
        arriving: what comes to each conjunction where each sends so much to each of its neighbours.  (h,) -> (h,)
    """

    def __init__(self, n_changes: np.ndarray, arriving: Callable[[np.ndarray], np.ndarray]) -> None:
        self.n_changes, self.arriving = n_changes, arriving


def one_change(
    needs: Sequence[Literals], neighbours: Callable[[int], Sequence[int]], *, n_others: int, max_literals: int
) -> OneChange:
    """Return the sums over neighbours, by whichever way suits so many conjunctions.

    Args:
        needs: all conjunctions of up to so many literals on so many other goals.
        neighbours: indices of those one change apart from one; asked of few only.
        n_others: goals that a literal can be about.
        max_literals: most literals of a conjunction.
    """
    if len(needs) <= LISTED:
        return by_neighbours([neighbours(i) for i in range(len(needs))])
    return by_common_parts(needs, n_others=n_others, max_literals=max_literals)


def by_neighbours(apart: Sequence[Sequence[int]]) -> OneChange:
    """Return the sums from a table of neighbours."""
    most = max(1, *map(len, apart))
    table = np.array([[*row, *[len(apart)] * (most - len(row))] for row in apart], dtype=np.int64)  # (h, most)
    return OneChange(
        np.array([max(1, len(row)) for row in apart]),
        lambda leaving: np.append(leaving, 0.0)[table].sum(axis=1),
    )


def by_common_parts(needs: Sequence[Literals], *, n_others: int, max_literals: int) -> OneChange:
    """Return the sums from what conjunctions have in common."""
    n_literals = np.array([(each.on | each.off).bit_count() for each in needs])
    parts = _parts(needs, max_literals)  # (h, max_literals), -1 where there is none
    is_part = parts >= 0
    free = n_others - n_literals
    n_changes = 2 * free * (n_literals < max_literals) + n_literals * (2 + 2 * free)

    def arriving(leaving: np.ndarray) -> np.ndarray:
        sent = np.broadcast_to(leaving[:, None], parts.shape)[is_part]
        above = np.bincount(parts[is_part], weights=sent, minlength=len(needs))
        below = np.where(is_part, (leaving + above)[parts], 0.0).sum(axis=1)
        return np.maximum(above + below - n_literals * leaving, 0.0)

    return OneChange(np.maximum(n_changes, 1), arriving)


def _parts(needs: Sequence[Literals], max_literals: int) -> np.ndarray:
    """Return for each conjunction the indices of those of one literal fewer.  () -> (h, max_literals)"""
    index_of = {(each.on, each.off): i for i, each in enumerate(needs)}
    parts = np.full((len(needs), max_literals), -1, dtype=np.int64)
    for i, each in enumerate(needs):
        members, k = each.on | each.off, 0
        while members:
            bit = members & -members
            members ^= bit
            parts[i, k] = index_of[each.on & ~bit, each.off & ~bit]
            k += 1
    return parts
