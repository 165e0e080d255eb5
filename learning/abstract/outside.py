"""Rules that no conjunction says: one way or another, so many of several, one after the other. Pure.

A learner whose beliefs are conjunctions cannot hold these. What it should do all the same is to master the goals, and
not to be certain of what is wrong.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from learning.abstract.rules import ROOM, TRIALS, Rule, draw_rules, permits

__all__ = ["KINDS", "AnyOf", "AtLeast", "InOrder", "draw_outside", "fewest_trials", "orders"]

KINDS = ("or", "two_of_three", "in_order")
N_REPLACED = 2
"""Goals of a table whose needs are of such a kind."""


class AnyOf(NamedTuple):
    """One goal or another must be on."""

    goals: tuple[int, ...]

    def permits(self, order: Sequence[int]) -> bool:
        """Whether it is met after goals came about in this order."""
        return any(goal in order for goal in self.goals)


class AtLeast(NamedTuple):
    """So many of several goals must be on."""

    n_least: int
    goals: tuple[int, ...]

    def permits(self, order: Sequence[int]) -> bool:
        """Whether it is met after goals came about in this order."""
        return sum(goal in order for goal in self.goals) >= self.n_least


class InOrder(NamedTuple):
    """Both goals must be on, and have come about in this order."""

    first: int
    then: int

    def permits(self, order: Sequence[int]) -> bool:
        """Whether it is met after goals came about in this order."""
        both = [goal for goal in order if goal in (self.first, self.then)]
        return both == [self.first, self.then]


def orders(rules: Sequence[Rule], *, n_most: int) -> list[tuple[int, ...]]:
    """Return every order in which goals can come about from none, of up to so many, shortest first."""
    found: list[tuple[int, ...]] = [()]
    for order in found:
        if len(order) < n_most:
            found.extend((*order, g) for g, rule in enumerate(rules) if g not in order and permits(rule, order))
    return found


def fewest_trials(rules: Sequence[Rule], *, n_most: int = TRIALS) -> tuple[int, ...]:
    """Return the fewest trials that each goal takes from none on; n_most where fewer than that do not do."""
    best = [n_most] * len(rules)
    for order in orders(rules, n_most=n_most - 1):
        for goal in order[-1:]:
            best[goal] = min(best[goal], len(order))
    return tuple(best)


def draw_outside(rng: np.random.Generator, kind: str, n_goals: int) -> tuple[Rule, ...]:
    """Draw rules of up to one literal a goal, with those of a kind for some of them; every goal can be achieved."""
    while True:
        rules: list[Rule] = list(draw_rules(rng, n_goals, max_literals=1))
        replaced = rng.choice(n_goals, size=N_REPLACED, replace=False)
        for goal in map(int, replaced):
            others = [i for i in range(n_goals) if i != goal]
            rules[goal] = _drawn(kind, [int(i) for i in rng.choice(others, size=3, replace=False)])
        if max(fewest_trials(tuple(rules), n_most=TRIALS - ROOM + 1)) <= TRIALS - ROOM:
            return tuple(rules)


def _drawn(kind: str, members: list[int]) -> Rule:
    match kind:
        case "or":
            return AnyOf(tuple(members[:2]))
        case "two_of_three":
            return AtLeast(2, tuple(members))
        case "in_order":
            return InOrder(*members[:2])
        case _:
            raise ValueError(f"expected one of {', '.join(KINDS)}, got {kind}")
