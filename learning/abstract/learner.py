"""The upper layers as the agent runs them, on a table without physics."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from config.learning import LearningConfig
from learning.abstract.oracle import Oracle, OracleGoals, OracleSubgoals, Told
from learning.abstract.rules import TRIALS
from learning.abstract.table import AbstractTable
from learning.agent import GoalSelector as ChoosesGoals
from learning.goal_selector import GoalSelector
from learning.graph import Graph
from learning.interfaces import Attempt, Grows, SubgoalSelector, TrialOutcome
from learning.subgoal_graph import GraphSelector
from learning.subgoal_selector import make_subgoal_selector

__all__ = ["AbstractLearner", "MakeAbstract", "as_config_says", "as_oracle"]

WINDOW = 20
"""Newest trials of a skill that its chance is told from."""


class AbstractLearner:
    """The upper layers as the agent runs them."""

    def __init__(self, *, n_goals: int, goal_selector: ChoosesGoals, selector: SubgoalSelector) -> None:
        self.n_goals = n_goals
        self.goal_selector = goal_selector
        self.selector = selector
        self._outcomes: list[list[bool]] = [[] for _ in range(n_goals)]

    def grow(self, n_goals: int) -> None:
        """Take in goals that become known; the table has had them all the time.

        Raises:
            TypeError: an upper layer takes in none.
        """
        for layer in (self.goal_selector, self.selector):
            if not isinstance(layer, Grows):
                raise TypeError(f"expected layers that take in new goals, {type(layer).__name__} does not")
            layer.grow(n_goals)
        self._resize(n_goals)

    def _resize(self, n_goals: int) -> None:
        self.n_goals = n_goals
        self._outcomes = [*self._outcomes[:n_goals], *([] for _ in range(n_goals - len(self._outcomes)))]

    def learn_epoch(self, table: AbstractTable, epoch: int) -> tuple[int, bool, int]:
        """Run one epoch of learning; return its goal, whether it was achieved, and the trials it took."""
        goal = self.goal_selector.select()
        predicted = self._skill(goal)
        is_achieved, n_trials = self._pursue(table, epoch, goal, explore=True)
        self.goal_selector.end_epoch(goal, predicted=predicted, is_achieved=is_achieved)
        return goal, is_achieved, n_trials

    def test_epoch(self, table: AbstractTable, epoch: int, goal: int) -> tuple[bool, int]:
        """Pursue a goal with learning off; return whether it was achieved, and the trials it took."""
        return self._pursue(table, epoch, goal, explore=False)

    @property
    def graph(self) -> Graph:
        """What is believed of goals, of a learner that has a graph."""
        assert isinstance(self.selector, GraphSelector)
        return self.selector.graph

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt."""
        return {
            "goal_selector": self.goal_selector.state_dict(),
            "selector": self.selector.state_dict(),
            "outcomes": [list(results) for results in self._outcomes],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.goal_selector.load_state_dict(state["goal_selector"])
        self.selector.load_state_dict(state["selector"])
        self._resize(len(state["outcomes"]))
        self._outcomes = [list(results) for results in state["outcomes"]]

    def _pursue(self, table: AbstractTable, epoch: int, goal: int, *, explore: bool) -> tuple[bool, int]:
        table.reset()
        n_trials = 0
        while n_trials < TRIALS and not table.latched[goal]:
            n_trials += 1
            attempt = self._trial(table, epoch, goal, explore=explore)
            if explore:
                self._learn(attempt)
        return table.latched[goal], n_trials

    def _trial(self, table: AbstractTable, epoch: int, goal: int, *, explore: bool) -> Attempt:
        n = self.n_goals
        state, holds = table.latched[:n], table.holds[:n]
        subgoal = self.selector.select(
            goal=goal, state=state, available=tuple(not h for h in holds),
            temperature=self.goal_selector.temperature(goal), explore=explore,
        )  # fmt: skip
        skill = self._skill(subgoal)
        outcome = table.attempt(subgoal, practise=explore)
        return Attempt(
            epoch=epoch, goal=goal, subgoal=subgoal, state=state, state_after=table.latched[:n], holds=holds,
            holds_after=table.holds[:n], outcome=outcome, predicted=skill, skill=skill, n_steps=1,
        )  # fmt: skip

    def _learn(self, attempt: Attempt) -> None:
        if attempt.outcome is not TrialOutcome.BLOCKED:
            self._outcomes[attempt.subgoal].append(attempt.outcome is TrialOutcome.ACHIEVED)
        self.goal_selector.update(attempt)
        self.selector.update(attempt)
        self.goal_selector.rearm(self.selector.changed_goals())

    def _skill(self, goal: int) -> float:
        newest = self._outcomes[goal][-WINDOW:]
        return (sum(newest) + 1) / (len(newest) + 2)


MakeAbstract = Callable[[int, np.random.Generator], AbstractLearner]
"""Makes a learner for so many goals that draws from a generator."""


def as_config_says(config: LearningConfig) -> MakeAbstract:
    """Return what makes learners with the upper layers of a config."""
    return partial(_configured, config)


def as_oracle(told: Told) -> MakeAbstract:
    """Return what makes oracles that are told so much."""
    return partial(_all_knowing, told)


def _configured(config: LearningConfig, n_goals: int, rng: np.random.Generator) -> AbstractLearner:
    first, second = rng.spawn(2)
    goals, subgoals = config.goal_selection, config.subgoal_selection
    return AbstractLearner(
        n_goals=n_goals,
        goal_selector=GoalSelector(n_goals=n_goals, config=goals, subgoals=subgoals, rng=first),
        selector=make_subgoal_selector(n_goals=n_goals, config=subgoals, rng=second),
    )


def _all_knowing(told: Told, n_goals: int, rng: np.random.Generator) -> AbstractLearner:
    if n_goals != told.n_goals:
        raise ValueError(f"expected the {told.n_goals} goals that the oracle was told of, got {n_goals}")
    oracle = Oracle(told)
    return AbstractLearner(n_goals=n_goals, goal_selector=OracleGoals(oracle, rng=rng), selector=OracleSubgoals(oracle))
