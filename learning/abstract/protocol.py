"""The paper's protocol without physics, any number of switches, in the project's words: mastered, learnt, right."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from statistics import fmean

import msgspec
import numpy as np

from learning.abstract.learner import AbstractLearner, MakeAbstract
from learning.abstract.oracle import OracleSubgoals
from learning.abstract.rules import TRIALS, Rules, optimal_trials, reachable_states, situation
from learning.abstract.table import AbstractTable, Skills, Things
from learning.interfaces import SubgoalSelector
from learning.subgoal_graph import GraphSelector

__all__ = [
    "DENSE_EVERY",
    "N_ENOUGH",
    "N_TESTS",
    "Era",
    "Evaluations",
    "Result",
    "foretelling",
    "is_graph_right",
    "run_abstract",
]

DENSE_EVERY, DENSE_FOR, EVERY = 10, 150, 50
"""How judged runs evaluate."""
N_TESTS, N_ENOUGH = 20, 18
LOOK_EVERY = 10
"""Epochs between looks at the graph."""
N_LAST = 200
HALF = 0.5


class Era(msgspec.Struct, frozen=True, kw_only=True):
    """What the span under one set of rules came to; epochs are counted from its beginning."""

    mastered: int | None
    """First of two evaluations running at which every goal was achieved in 18 of 20 test epochs."""
    right: int | None
    """Epoch from which the graph was right and stayed so until the era's end, as far as it was looked at."""
    over_optimum: float
    """Trials over the optimum, mean over goals of the mean over their learning epochs, the last 200 of the era."""
    success: float
    """Share of learning epochs achieved, the last 200."""
    goals: tuple[int, ...]
    """Goal of each epoch."""
    least_success: float
    """Of the least successful goal, the last 200 epochs; 1 where no goal was chosen."""


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """What one run came to, era by era."""

    eras: tuple[Era, ...]
    table: AbstractTable
    learner: AbstractLearner


def run_abstract(
    *,
    seed: int,
    learner: MakeAbstract,
    eras: Sequence[Rules],
    epochs: int = 1000,
    skills: Skills | None = None,
    things: Things | None = None,
) -> Result:
    """Learn for so many epochs under each set of rules and measure as judged runs are."""
    first, second = np.random.default_rng(seed).spawn(2)
    n_goals = len(eras[0])
    table = AbstractTable(n_goals=n_goals, skills=skills or Skills(), rng=first, things=things)
    made = learner(n_goals, second)
    ended = [_run_era(table, made, rules, n_before=i * epochs, epochs=epochs) for i, rules in enumerate(eras)]
    return Result(eras=tuple(ended), table=table, learner=made)


class Evaluations:
    """Whether all goals are mastered, evaluation by evaluation, until they are twice running.

    Args:
        goals: those that can be achieved.
    """

    def __init__(self, goals: Sequence[int]) -> None:
        self._goals = goals
        self._at: list[tuple[int, bool]] = []

    @property
    def mastered(self) -> int | None:
        """First of two evaluations running at which every goal was mastered, None where there was none."""
        return next((epoch for (epoch, is_one), (_, is_next) in pairwise(self._at) if is_one and is_next), None)

    def look(self, i: int, table: AbstractTable, learner: AbstractLearner, epoch: int) -> None:
        """Evaluate after so many epochs of an era, where that is due."""
        if i % (DENSE_EVERY if i <= DENSE_FOR else EVERY) == 0 and self.mastered is None:
            self._at.append((i, _all_mastered(table, learner, epoch, self._goals)))


def _run_era(table: AbstractTable, learner: AbstractLearner, rules: Rules, *, n_before: int, epochs: int) -> Era:
    table.rules = rules
    rows: list[tuple[int, bool, int]] = []
    optimum = optimal_trials(rules)
    evaluations = Evaluations([goal for goal, n_trials in enumerate(optimum) if n_trials < TRIALS])
    wrong_until = 0
    has_graph = foretelling(learner.selector) is not None
    for i in range(1, epochs + 1):
        rows.append(learner.learn_epoch(table, n_before + i))
        evaluations.look(i, table, learner, n_before + i)
        if has_graph and i % LOOK_EVERY == 0 and not is_graph_right(learner.selector, rules):
            wrong_until = i
    last = rows[-N_LAST:]
    by_goal = [[(ok, n - optimum[goal]) for chosen, ok, n in last if chosen == goal] for goal in range(len(rules))]
    return Era(
        mastered=evaluations.mastered,
        right=wrong_until + LOOK_EVERY if has_graph and wrong_until < epochs else None,
        over_optimum=fmean(fmean(n for _, n in row) if row else 0.0 for row in by_goal),
        success=fmean(ok for _, ok, _ in last),
        least_success=min(fmean(ok for ok, _ in row) for row in by_goal if row),
        goals=tuple(goal for goal, _, _ in rows),
    )


def _all_mastered(table: AbstractTable, learner: AbstractLearner, epoch: int, goals: Sequence[int]) -> bool:
    """Whether every one of the goals is achieved often enough, learning off."""
    return all(sum(learner.test_epoch(table, epoch, goal)[0] for _ in range(N_TESTS)) >= N_ENOUGH for goal in goals)


def is_graph_right(selector: SubgoalSelector, rules: Rules) -> bool:
    """Whether the graph says the same as the rules of every goal in every goal-state that can be reached without it.

    Where a goal is on it cannot be tried: what is needed there, nobody could find out.
    """
    chance = foretelling(selector)
    assert chance is not None
    return all(
        (chance(g, state) > HALF) == needed.allow(situation(state))
        for state in reachable_states(rules)
        for g, needed in enumerate(rules)
        if not state >> g & 1
    )


def foretelling(selector: SubgoalSelector) -> Callable[[int, int], float] | None:
    """Return what says how probably a goal is allowed in a goal-state; None where nothing is believed of that."""
    if isinstance(selector, GraphSelector):
        beliefs = selector.graph.beliefs
        return lambda goal, state: beliefs[goal].predict_allowed(situation(state))
    if isinstance(selector, OracleSubgoals):
        allowed = selector.oracle.allowed()
        return lambda goal, state: allowed[goal, state]
    return None
