"""Sums over the conjunctions that a situation allows, without looking at the others. Pure.

Of the members that a conjunction is about a situation allows one choice of signs at most: so of 24 goals and up to
three literals 2,048 conjunctions are looked up, where there are 15,227. Sums come in another order than a product with
all of them, and differ from it by rounding.
"""

from itertools import combinations

import numpy as np

from robot.compiled import Ints2, Table, compiled

__all__ = ["AllowedMass"]

COUNT, FIRST, MEMBERS = 0, 1, 2
"""Columns: how many members, the index of the conjunction in which all of them must be on, and the members."""
NEITHER = 1 << 20
"""In place of a sign where a situation allows none; greater than any choice of signs."""


@compiled
def _mass(rows: Ints2, n_goals: int, holds: int, latched: int, weights: Table) -> float:
    """Add up a weight for each conjunction that is allowed.

    Args:
        rows: members.  (c, 2 + most)
        n_goals: how many goals there are.
        holds: goals that hold, as bits; each of them is latched.
        latched: goals that were achieved, as bits.
        weights: of each conjunction.  (1, h)
    """
    signs = np.zeros(n_goals, dtype=np.int64)
    for goal in range(n_goals):
        is_on = holds >> goal & 1
        signs[goal] = 0 if is_on else (NEITHER if latched >> goal & 1 else 1)
    total = 0.0
    for c in range(len(rows)):
        code = 0
        for k in range(rows[c, COUNT]):
            code = code << 1 | signs[rows[c, MEMBERS + k]]
        if code < NEITHER:
            total += weights[0, rows[c, FIRST] + code]
    return total


@compiled
def _marginals(rows: Ints2, n_goals: int, weights: Table) -> Table:
    """Add up for each goal the weights of the conjunctions in which it must be on, and in which off.  -> (n, 2)"""
    sums = np.zeros((n_goals, 2))
    for c in range(len(rows)):
        n = rows[c, COUNT]
        for code in range(1 << n):
            weight = weights[0, rows[c, FIRST] + code]
            for k in range(n):
                sums[rows[c, MEMBERS + k], code >> (n - 1 - k) & 1] += weight
    return sums


class AllowedMass:
    """What is asked of conjunctions in the order of `learning.preconditions.conjunctions`.

    Args:
        n_goals: how many goals there are.
        goal: the one whose conjunctions these are; no literal is about it.
        max_literals: most literals of a conjunction.
    """

    def __init__(self, *, n_goals: int, goal: int, max_literals: int) -> None:
        others = [i for i in range(n_goals) if i != goal]
        rows, first = [], 0
        for n in range(min(max_literals, len(others)) + 1):
            for members in combinations(others, n):
                rows.append([n, first, *members, *[0] * (max_literals - n)])
                first += 1 << n
        self._rows, self._n_goals = np.array(rows, dtype=np.int32), n_goals

    def of(self, weights: np.ndarray, *, holds: int, latched: int) -> float:
        """Return the sum of the weights of the conjunctions that are allowed.

        Args:
            weights: of each conjunction.  (h,)
            holds: goals that hold, as bits; each of them is latched.
            latched: goals achieved at some time, as bits.
        """
        return _mass(self._rows, self._n_goals, holds, latched, weights.reshape(1, -1))

    def marginals(self, weights: np.ndarray) -> list[tuple[float, float]]:
        """Return for each goal the sum where it must be on, and where it must be off.  (h,) -> (n, 2)"""
        return [(on, off) for on, off in _marginals(self._rows, self._n_goals, weights.reshape(1, -1)).tolist()]
