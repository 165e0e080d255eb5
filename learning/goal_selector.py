"""The goal selector: an N-armed bandit that chooses the goal of each epoch by competence improvement.

Values are exponential moving averages of ΔC^g; the goal is drawn by softmax over them. A bandit on improvement starves
what is mastered, so that a later break is noticed only by luck: a floor under the probabilities keeps looking, and a
goal whose believed needs changed, or that begins to fail, is armed again.
"""

from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from config.learning import GoalSelection, SubgoalSelection
from learning.choice import draw, softmax
from learning.competence import (
    absolute_improvement,
    clipped_success_improvement,
    delta_competence,
    has_dropped,
    running_success,
    subgoal_temperature,
)
from learning.interfaces import Attempt, TrialOutcome

__all__ = ["GoalSelector"]

FAILING = 0.05
"""Rate of failure taken to be on top of every goal's own, so that no single failure draws all attention."""


class GoalSelector:
    """Chooses goals, keeps each goal's record of attempts, and sets the sub-goal selector's temperature by it.

    An attempt is credited to the sub-goal tried in a trial, or, with credit `main_goal`, a whole epoch counts as one
    attempt at its goal.
    """

    def __init__(
        self, *, n_goals: int, config: GoalSelection, subgoals: SubgoalSelection, rng: np.random.Generator
    ) -> None:
        self._config = config
        self._subgoals = subgoals
        self._rng = rng
        self._values = np.zeros(0)
        self._cp: list[deque[float]] = []
        self._results: list[deque[float]] = []
        self._epochs: list[deque[float]] = []
        """What came of the newest epochs that had a goal."""
        self._resize(n_goals)

    # ----------------------------------------------------------------------------------------------------- decide

    def select(self) -> int:
        """Return the goal of the next epoch."""
        return draw(self.probabilities(), self._rng)

    def probabilities(self) -> np.ndarray:
        """Return each goal's chance of being chosen next.  () -> (n,)"""
        floor, by_failure = self._config.probability_floor, self._config.floor_by_failure
        failing = np.array([FAILING + 1.0 - self.epoch_success(goal) for goal in range(len(self._values))])  # (n,)
        spread = by_failure * failing / failing.sum() + (1.0 - by_failure) / len(failing)
        return (1.0 - floor) * softmax(self._values, self._config.temperature) + floor * spread

    def temperature(self, goal: int) -> float:
        """Return the temperature of the sub-goal choice while pursuing a goal."""
        return subgoal_temperature(self._subgoals, improvement=self.improvement(goal), success=self.success(goal))

    # ------------------------------------------------------------------------------------------------------ learn

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. A void one is evidence about nothing."""
        if self._config.credit == "subgoal" and attempt.outcome is not TrialOutcome.VOID:
            worth = self._config.explored_worth if attempt.is_explored else 1.0
            result = worth * (attempt.outcome is TrialOutcome.ACHIEVED)
            self._credit(attempt.subgoal, predicted=attempt.predicted, result=result)

    def end_epoch(self, goal: int, *, predicted: float, is_achieved: bool) -> None:
        """Learn from one epoch that was not void; predicted is the chance of its goal said at the epoch's start."""
        self._epochs[goal].append(float(is_achieved))
        if self._config.credit == "main_goal":
            self._credit(goal, predicted=predicted, result=float(is_achieved))

    def rearm(self, goals: Iterable[int]) -> None:
        """Raise the values of goals whose believed needs have changed, where the config asks for it."""
        if self._config.rearm:
            for goal in goals:
                self._values[goal] = max(float(self._values.max()), self._config.rearm_value)

    def grow(self, n_goals: int) -> None:
        """Take in new goals: nothing was tried of them, and where the config arms goals again they are armed."""
        new = range(len(self._values), n_goals)
        self._resize(n_goals)
        self.rearm(new)

    def _resize(self, n_goals: int) -> None:
        n_before, window = len(self._values), self._config.window
        self._values = np.concatenate([self._values[:n_goals], np.zeros(max(0, n_goals - n_before))])
        n_kept = max(2 * window, self._subgoals.competence_window)
        for kept, maxlen in ((self._cp, n_kept), (self._results, n_kept), (self._epochs, window)):
            kept[:] = [*kept[:n_goals], *(deque[float](maxlen=maxlen) for _ in range(n_goals - n_before))]

    def _credit(self, goal: int, *, predicted: float, result: float) -> None:
        expected = predicted if self._config.prediction == "expert_utility" else self.success(goal)
        self._cp[goal].append(expected - result)
        self._results[goal].append(result)
        self._values[goal] += self._config.ema_rate * (self.improvement(goal) - self._values[goal])
        if has_dropped(list(self._results[goal]), self._config.window):
            self.rearm((goal,))

    # ------------------------------------------------------------------------------------------------------- tell

    def improvement(self, goal: int) -> float:
        """Return ΔC^g in the reading that the config asks for."""
        window = self._config.window
        match self._config.improvement:
            case "printed":
                return delta_competence(list(self._cp[goal]), window)
            case "clipped_success":
                return clipped_success_improvement(list(self._results[goal]), window)
            case "absolute":
                return absolute_improvement(list(self._results[goal]), window)

    def success(self, goal: int) -> float:
        """Return the running success of a goal."""
        return running_success(list(self._results[goal]), self._subgoals.competence_window)

    def epoch_success(self, goal: int) -> float:
        """Return the share of a goal's newest epochs in which it was achieved."""
        return running_success(list(self._epochs[goal]), self._config.window)

    @property
    def values(self) -> tuple[float, ...]:
        """Each goal's value."""
        return tuple(self._values.tolist())

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return {
            "values": self._values.copy(),
            "cp": [list(kept) for kept in self._cp],
            "results": [list(kept) for kept in self._results],
            "epochs": [list(kept) for kept in self._epochs],
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._resize(len(state["values"]))
        self._values = np.array(state["values"], dtype=float)
        kept_before = (*state["cp"], *state["results"], *state["epochs"])
        for kept, loaded in zip((*self._cp, *self._results, *self._epochs), kept_before, strict=True):
            kept.clear()
            kept.extend(loaded)
        self._rng.bit_generator.state = state["rng"]
