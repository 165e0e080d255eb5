"""The sub-goal selectors `q` and `q_hindsight`: Q-learning over goal-states.

Per goal g a table Q_g[goal-state, sub-goal], sparse: a goal-state that never was has no row. The reinforcement r^g is 1
when g is achieved; the epoch's pursuit of g ends there.
"""

from collections import deque
from typing import Any, NamedTuple

import numpy as np

from config.learning import SubgoalSelection
from learning.choice import draw, softmax
from learning.interfaces import Attempt, GoalState, TrialOutcome
from learning.preconditions import mask

__all__ = ["QHindsightSelector", "QSelector"]


class _Transition(NamedTuple):
    """One trial as Q-learning sees it; goal-states are bit masks."""

    s_tm1: int
    a_tm1: int
    s_t: int


class QSelector:
    """The paper's sub-goal selector: Q-learning on the epoch's goal alone, each experience used once."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        self._n = n_goals
        self._config = config
        self._rng = rng
        self._q: dict[int, np.ndarray] = {}
        """Goal-state -> Q of each goal and sub-goal, (n, n)."""
        self._known: set[tuple[int, int]] = set()
        """Goal-states and sub-goals that were achieved from them."""
        self._order = rng.permutation(n_goals)
        """Which comes first among equals: by index, a table listed in the order of its needs would solve itself."""

    # ----------------------------------------------------------------------------------------------------- decide

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return a sub-goal by softmax over the available ones' Q; without explore the best one."""
        q = self.q_values(goal, state)
        if explore:
            return draw(softmax(q, temperature, available), self._rng)
        p = softmax(q, 1.0, available)
        return int(self._order[np.argmax(p[self._order])])

    def q_values(self, goal: int, state: GoalState) -> np.ndarray:
        """Return the Q of each sub-goal in a goal-state while pursuing a goal.  () -> (n,)"""
        row = self._q.get(mask(state))
        return np.zeros(self._n) if row is None else row[goal].copy()

    # ------------------------------------------------------------------------------------------------------ learn

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. Void attempts change nothing."""
        transition = self._take_in(attempt)
        if transition is not None:
            self._learn(transition, goals=(attempt.goal,))

    def changed_goals(self) -> tuple[int, ...]:
        """Return nothing: a table of Q-values does not say what changed."""
        return ()

    def grow(self, n_goals: int) -> None:
        """Take in new goals: of what leads to them, and of what they lead to, nothing is known."""
        more = n_goals - self._n
        self._q = {s: np.pad(row, ((0, more), (0, more))) for s, row in self._q.items()}
        for goal in range(self._n, n_goals):
            self._order = np.insert(self._order, int(self._rng.integers(len(self._order) + 1)), goal)
        self._n = n_goals

    def _take_in(self, attempt: Attempt) -> _Transition | None:
        """Return the trial's transition, or None where it teaches nothing.

        The known-context rule: a failure counts only if the sub-goal was once achieved from this goal-state.
        """
        if attempt.outcome is TrialOutcome.VOID:
            return None
        s_tm1, a_tm1 = mask(attempt.state), attempt.subgoal
        if attempt.outcome is TrialOutcome.ACHIEVED:
            self._known.add((s_tm1, a_tm1))
        elif self._config.known_context and (s_tm1, a_tm1) not in self._known:
            return None
        return _Transition(s_tm1, a_tm1, mask(attempt.state_after))

    def _learn(self, transition: _Transition, goals: tuple[int, ...]) -> None:
        """Move Q towards r^g + γ max Q of the next goal-state, for each goal not yet achieved before."""
        s_tm1, a_tm1, s_t = transition
        q_tm1, q_t = self._row(s_tm1), self._row(s_t)
        for g in goals:
            if s_tm1 >> g & 1:
                continue
            target = 1.0 if s_t >> g & 1 else self._config.gamma * self._best(q_t[g], s_t)
            q_tm1[g, a_tm1] += self._config.alpha * (target - q_tm1[g, a_tm1])

    def _best(self, q: np.ndarray, state: int) -> float:
        """Return the greatest Q among the sub-goals not achieved in a goal-state."""
        return max(float(q[i]) for i in range(self._n) if not state >> i & 1)

    def _row(self, state: int) -> np.ndarray:
        return self._q.setdefault(state, np.zeros((self._n, self._n)))

    # ------------------------------------------------------------------------------------------------------- tell

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return {
            "states": np.array(list(self._q), dtype=np.int64),
            "q": np.array(list(self._q.values())).reshape(-1, self._n, self._n),
            "known": np.array(sorted(self._known), dtype=np.int64).reshape(-1, 2),
            "order": self._order.copy(),
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._n = len(state["order"])
        self._q = {int(s): np.array(row) for s, row in zip(state["states"], state["q"], strict=True)}
        self._known = {(int(s), int(a)) for s, a in state["known"]}
        self._order = np.array(state["order"], dtype=np.int64)
        self._rng.bit_generator.state = state["rng"]


class QHindsightSelector(QSelector):
    """Q-learning that learns about every goal from each trial (hindsight) and replays recent trials (Dyna)."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        super().__init__(n_goals=n_goals, config=config, rng=rng)
        self._replay = deque[_Transition](maxlen=config.dyna_buffer)

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial, then from replayed ones, about every goal."""
        transition = self._take_in(attempt)
        if transition is None:
            return
        every = tuple(range(self._n))
        self._learn(transition, goals=every)
        self._replay.append(transition)
        for i in self._rng.integers(len(self._replay), size=self._config.dyna_replays):
            self._learn(self._replay[int(i)], goals=every)

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt, the replay buffer and the generator's state."""
        return super().state_dict() | {"replay": np.array(self._replay, dtype=np.int64).reshape(-1, 3)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        super().load_state_dict(state)
        self._replay.clear()
        self._replay.extend(_Transition(int(s), int(a), int(t)) for s, a, t in state["replay"])
