"""Rules of a table without physics: what each goal needs, which goal-states can come about, the fewest trials. Pure."""

from collections.abc import Sequence
from math import comb
from typing import Protocol

import numpy as np

from learning.interfaces import GoalState
from learning.planning import Effort, cheapest_plan
from learning.preconditions import START, Needs, Situation, conjunctions

__all__ = [
    "TRIALS",
    "Permits",
    "Rule",
    "Rules",
    "bits",
    "chance_of_needs",
    "draw_more_rules",
    "draw_rules",
    "needs",
    "optimal_trials",
    "permits",
    "reachable_states",
    "situation",
]

Rules = tuple[Needs, ...]


class Permits(Protocol):
    """Needs that are no conjunction (learning/abstract/outside.py)."""

    def permits(self, order: Sequence[int]) -> bool:
        """Whether they are met after goals came about in this order."""
        ...


Rule = Needs | Permits
TRIALS = 8
"""That an epoch has."""
ON_SHARE = 0.6
"""Of the literals that are drawn, those that ask for a goal and not against it."""
ROOM = 3
"""Trials that a drawn goal leaves over at least."""


def needs(on: Sequence[int] = (), off: Sequence[int] = ()) -> Needs:
    """Return a conjunction from goal indices."""
    return Needs(sum(1 << i for i in on), sum(1 << i for i in off))


def permits(rule: Rule, order: Sequence[int]) -> bool:
    """Return whether a goal may come about after others did in this order."""
    if isinstance(rule, Needs):
        return rule.allow(situation(sum(1 << goal for goal in order)))
    return rule.permits(order)


def reachable_states(rules: Rules) -> set[int]:
    """Return every goal-state that can come about from the empty one."""
    found, frontier = {0}, [0]
    while frontier:
        state = frontier.pop()
        for g, needed in enumerate(rules):
            there = state | 1 << g
            if needed.allow(situation(state)) and there not in found:
                found.add(there)
                frontier.append(there)
    return found


def optimal_trials(rules: Rules) -> tuple[int, ...]:
    """Return the fewest trials that each goal takes from the empty goal-state."""
    plans = [cheapest_plan(g, START, rules.__getitem__, _effort(len(rules))) for g in range(len(rules))]
    return tuple(len(plan) if plan else TRIALS for plan in plans)


def draw_rules(rng: np.random.Generator, n_goals: int, *, max_literals: int = 3) -> Rules:
    """Draw needs of up to so many literals, on and off, such that every goal can be achieved within the trials."""
    while True:
        rules = tuple(_draw_needs(rng, g, n_goals, max_literals) for g in range(n_goals))
        plans = [cheapest_plan(g, START, rules.__getitem__, _effort(n_goals)) for g in range(n_goals)]
        if all(plan and len(plan) <= TRIALS - ROOM for plan in plans):
            return rules


def draw_more_rules(rng: np.random.Generator, rules: Rules, n_goals: int, *, max_literals: int = 3) -> Rules:
    """Draw needs of further goals, on any others, such that all can be achieved; these need none of them."""
    while True:
        more = tuple(_draw_needs(rng, g, n_goals, max_literals) for g in range(len(rules), n_goals))
        whole = (*rules, *more)
        plans = [cheapest_plan(g, START, whole.__getitem__, _effort(n_goals)) for g in range(n_goals)]
        if all(plan and len(plan) <= TRIALS - ROOM for plan in plans):
            return whole


def _effort(n_goals: int) -> Effort:
    return Effort(trials=[1.0] * n_goals, losses=[[0.0] * n_goals] * n_goals)


def _draw_needs(rng: np.random.Generator, goal: int, n_goals: int, max_literals: int) -> Needs:
    others = [i for i in range(n_goals) if i != goal]
    members = rng.choice(others, size=int(rng.integers(0, max_literals + 1)), replace=False)
    is_on = rng.random(len(members)) < ON_SHARE
    return needs([int(i) for i in members[is_on]], [int(i) for i in members[~is_on]])


def chance_of_needs(n_goals: int, goal: int, max_literals: int) -> dict[Needs, float]:
    """Return how probable each need of a goal is as `draw_rules` draws it, before it leaves out what cannot be."""
    chances: dict[Needs, float] = {}
    for drawn in conjunctions(n_goals, goal, max_literals):
        n_on, n_off = drawn.on.bit_count(), drawn.off.bit_count()
        signs = ON_SHARE**n_on * (1.0 - ON_SHARE) ** n_off
        chances[drawn] = signs / (max_literals + 1) / comb(n_goals - 1, n_on + n_off)
    return chances


def situation(state: int) -> Situation:
    """Return a goal-state as what a plan starts from."""
    return Situation(state, state)


def bits(state: GoalState) -> int:
    """Return a goal-state as a bit mask."""
    return sum(1 << i for i, is_on in enumerate(state) if is_on)
