"""Sub-goal selectors after other architectures of the same family, to compare with. Our readings; nobody's own code.

* `direct` has no layer of sub-goals: a goal is tried by its own expert, whatever it may need (as GRAIL: Santucci,
  Baldassarre, Mirolli 2016).
* `mdp` chooses every trial by one table of values over goal-states whose reward is how much the tried goal improves, so
  that curiosity itself is led through what opens the way (as M-GRAIL: Santucci, Baldassarre, Cartoni 2019). What is
  learnt of the way to a goal in passing serves when that goal is asked for.
* `q_drop` takes a goal that fails where it used to succeed for another context, and begins its tables anew (as C-GRAIL:
  Santucci, Montella, Baldassarre 2022, without the memory of former contexts).
"""

from collections import deque
from typing import Any

import numpy as np

from config.learning import SubgoalSelection
from learning.choice import draw, softmax
from learning.competence import absolute_improvement, has_dropped
from learning.interfaces import Attempt, GoalState, TrialOutcome
from learning.preconditions import mask
from learning.subgoal_q import QHindsightSelector

__all__ = ["DirectSelector", "DropSelector", "MdpSelector"]


class DirectSelector:
    """Tries the wanted goal itself. Learns nothing."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        del n_goals, config, rng

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return the goal, or the first available one where it is not."""
        del state, temperature, explore
        if not any(available):
            raise ValueError("expected at least one available sub-goal, got none")
        return goal if available[goal] else available.index(True)

    def update(self, attempt: Attempt) -> None:
        """Learn nothing."""

    def grow(self, n_goals: int) -> None:
        """Learn nothing of new goals either."""

    def changed_goals(self) -> tuple[int, ...]:
        """Return nothing: nothing is believed."""
        return ()

    def state_dict(self) -> dict[str, Any]:
        """Return nothing."""
        return {}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore nothing."""


class _Recording(QHindsightSelector):
    """Keeps what came of the newest attempts at each sub-goal."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        super().__init__(n_goals=n_goals, config=config, rng=rng)
        self._results = [deque[float](maxlen=2 * config.competence_window) for _ in range(n_goals)]

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. Void attempts change nothing."""
        super().update(attempt)
        if attempt.outcome is not TrialOutcome.VOID:
            self._results[attempt.subgoal].append(float(attempt.outcome is TrialOutcome.ACHIEVED))

    def grow(self, n_goals: int) -> None:
        """Take in new goals, of which there are no results."""
        super().grow(n_goals)
        self._resize_results(n_goals)

    def _resize_results(self, n_goals: int) -> None:
        more = range(n_goals - len(self._results))
        new = (deque[float](maxlen=2 * self._config.competence_window) for _ in more)
        self._results = [*self._results[:n_goals], *new]

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt, the newest results and the generator's state."""
        return super().state_dict() | {"results": [list(kept) for kept in self._results]}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        super().load_state_dict(state)
        self._resize_results(len(state["results"]))
        for kept, loaded in zip(self._results, state["results"], strict=True):
            kept.clear()
            kept.extend(loaded)


class DropSelector(_Recording):
    """Q-learning with hindsight whose tables begin anew when a goal begins to fail."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        super().__init__(n_goals=n_goals, config=config, rng=rng)
        self._changed: tuple[int, ...] = ()

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial, and forget all that was learnt where it shows another context."""
        super().update(attempt)
        self._changed = ()
        if has_dropped(list(self._results[attempt.subgoal]), self._config.competence_window):
            self._q.clear()
            self._known.clear()
            self._replay.clear()
            for kept in self._results:
                kept.clear()
            self._changed = tuple(range(self._n))

    def changed_goals(self) -> tuple[int, ...]:
        """Return every goal, where the last trial showed another context."""
        return self._changed

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return super().state_dict() | {"changed": list(self._changed)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        super().load_state_dict(state)
        self._changed = tuple(int(goal) for goal in state["changed"])


class MdpSelector(_Recording):
    """Explores by values of improvement over goal-states; pursues a goal that is asked for by what hindsight knows."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        super().__init__(n_goals=n_goals, config=config, rng=rng)
        self._worth: dict[int, np.ndarray] = {}
        """Goal-state -> how much improvement each sub-goal promises, now and after it, (n,)."""

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return a sub-goal by softmax over what it promises; without explore the best one towards the goal."""
        if not explore:
            return super().select(goal=goal, state=state, available=available, temperature=temperature, explore=False)
        worth = self._worth.get(mask(state), np.zeros(self._n))
        return draw(softmax(worth, self._config.temperature_least, available), self._rng)

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial."""
        super().update(attempt)
        if attempt.outcome is TrialOutcome.VOID:
            return
        results = list(self._results[attempt.subgoal])
        improvement = absolute_improvement(results, self._config.competence_window)
        before, after = mask(attempt.state), mask(attempt.state_after)
        ahead = self._best(self._worth.get(after, np.zeros(self._n)), after) if after != (1 << self._n) - 1 else 0.0
        row = self._worth.setdefault(before, np.zeros(self._n))
        target = improvement + self._config.gamma * ahead
        row[attempt.subgoal] += self._config.alpha * (target - row[attempt.subgoal])

    def grow(self, n_goals: int) -> None:
        """Take in new goals, which promise nothing yet."""
        more = n_goals - self._n
        super().grow(n_goals)
        self._worth = {state: np.pad(row, (0, more)) for state, row in self._worth.items()}

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        states = np.array(list(self._worth), dtype=np.int64)
        rows = np.array(list(self._worth.values())).reshape(-1, self._n)
        return super().state_dict() | {"worth_states": states, "worth": rows}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        super().load_state_dict(state)
        self._worth = {int(s): np.array(row) for s, row in zip(state["worth_states"], state["worth"], strict=True)}
