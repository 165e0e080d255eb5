"""The sub-goal selector `graph`: learns what each goal needs, and plans backwards from the wanted one.

Each goal has a posterior over its preconditions (learning/preconditions.py). While learning, one conjunction is drawn
per goal (Thompson sampling), so that what is doubtful is tried as often as it is probable; when tested, the most
probable ones hold. The plan is the cheapest path over goal-states (learning/planning.py); its first step is chosen.
The softmax temperature has no part in this: exploration dies out as the posterior sharpens and wakes with surprise.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from config.learning import SubgoalSelection
from learning.interfaces import Attempt, GoalState, TrialOutcome
from learning.planning import cheapest_plan, relevant_goals
from learning.preconditions import Belief, Evidence, Likelihood, Needs, mask

__all__ = ["GraphSelector"]

LEAST_SKILL = 0.05
N_DRAWS = 4
"""Draws tried before a goal counts as out of reach in this goal-state."""
N_EVIDENCE = 200
"""Attempts remembered per goal, for explanations only."""
N_CARRIED = 50.0


class GraphSelector:
    """Bayesian preconditions and planning. Goals are indices; nothing else is known of them."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        self._n = n_goals
        self._config = config
        self._rng = rng
        self.beliefs = tuple(
            Belief(n_goals=n_goals, goal=g, max_literals=config.max_literals, literal_cost=config.literal_cost)
            for g in range(n_goals)
        )
        self._skill = [1.0] * n_goals
        self._n_carried = [0.0] * n_goals
        self._n_lost = [0.0] * n_goals
        self._held_for = [belief.most_probable()[0] for belief in self.beliefs]
        self._changed_epoch: list[int | None] = [None] * n_goals
        self._changed: tuple[int, ...] = ()
        self._log = tuple(deque[Evidence](maxlen=N_EVIDENCE) for _ in range(n_goals))

    # ----------------------------------------------------------------------------------------------------- decide

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return the first step of the plan for a goal; what was achieved but is available again counts as not on."""
        del temperature
        if not any(available):
            raise ValueError("expected at least one available sub-goal, got none")
        here = mask(state) & ~mask(available)
        for _ in range(N_DRAWS if explore else 1):
            plan = self._plan(goal, here, self._draw() if explore else self._most_probable)
            if plan and available[plan[0]]:
                return plan[0]
        if explore:
            return self._most_doubtful(here, available)
        return goal if available[goal] else available.index(True)

    def plan(self, goal: int, state: int = 0) -> tuple[int, ...] | None:
        """Return the present plan for a goal from a goal-state, the goal last, or None where none is believed in."""
        return self._plan(goal, state, self._most_probable)

    def _plan(self, goal: int, here: int, needs_of: Callable[[int], Needs]) -> tuple[int, ...] | None:
        costs = [1.0 / max(skill, LEAST_SKILL) for skill in self._skill]
        carrying = [lost / (carried + 1.0) for lost, carried in zip(self._n_lost, self._n_carried, strict=True)]
        return cheapest_plan(goal, here, needs_of, costs, carrying)

    def _most_probable(self, goal: int) -> Needs:
        return self.beliefs[goal].most_probable()[0]

    def _draw(self) -> Callable[[int], Needs]:
        """Return a function that draws each goal's needs once, when first asked."""
        drawn: dict[int, Needs] = {}

        def needs_of(goal: int) -> Needs:
            if goal not in drawn:
                drawn[goal] = self.beliefs[goal].sample(self._rng)
            return drawn[goal]

        return needs_of

    def _most_doubtful(self, here: int, available: tuple[bool, ...]) -> int:
        """Return the available goal of which it is least known whether it is allowed here."""
        doubts = [abs(self.beliefs[i].predict_allowed(here) - 0.5) if available[i] else np.inf for i in range(self._n)]
        return int(np.argmin(doubts))

    # ------------------------------------------------------------------------------------------------------ learn

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial: what was tried, and what came about by accident."""
        self._changed = ()
        if attempt.outcome is TrialOutcome.VOID:
            return
        self._skill[attempt.subgoal] = attempt.skill
        self._count_losses(attempt)
        before, after = mask(attempt.state), mask(attempt.state_after)
        if attempt.outcome is TrialOutcome.ACHIEVED:
            self._learn(attempt.subgoal, attempt, is_achieved=True)
        elif attempt.outcome is TrialOutcome.BLOCKED or not self._config.use_blocked_only:
            self._learn(attempt.subgoal, attempt, is_achieved=False)
        for i in range(self._n):
            if i != attempt.subgoal and after & ~before & 1 << i:
                self._learn(i, attempt, is_achieved=True)

    def changed_goals(self) -> tuple[int, ...]:
        """Return the goals for which what they need, directly or not, was revised by the last update."""
        return self._changed

    def predict_allowed(self, goal: int, state: GoalState) -> float:
        """Return the probability that a goal can come about in a goal-state."""
        return self.beliefs[goal].predict_allowed(mask(state))

    def _learn(self, goal: int, attempt: Attempt, *, is_achieved: bool) -> None:
        belief, old = self.beliefs[goal], self._most_probable(goal)
        evidence = Evidence(epoch=attempt.epoch, is_achieved=is_achieved, readings=_readings(goal, attempt))
        belief.mix_with_prior(self._config.hazard)
        belief.update(evidence, self._likelihood(attempt.skill))
        self._log[goal].append(evidence)
        if self._most_probable(goal) != old:
            self._changed_epoch[goal] = attempt.epoch
            self._changed += tuple(
                i for i in range(self._n) if goal in relevant_goals(i, 0, self._most_probable) and i not in self._changed
            )

    def _likelihood(self, skill: float) -> Likelihood:
        """Return how telling an attempt is. An expert that was at the place fails less often than its skill says."""
        least = 0.5 if self._config.use_blocked_only else LEAST_SKILL
        p_hit = min(max(skill, least), 1.0 - self._config.blocked_error)
        return Likelihood(p_hit=p_hit, false_positive=self._config.false_positive)

    def _count_losses(self, attempt: Attempt) -> None:
        """Count how often what held at a trial's start held no longer at its end: such goals are best achieved late."""
        if attempt.holds is None or attempt.holds_after is None:
            return
        for i, (held, holds) in enumerate(zip(attempt.holds, attempt.holds_after, strict=True)):
            if held and i != attempt.subgoal:
                keep = 1.0 - 1.0 / N_CARRIED
                self._n_carried[i] = keep * self._n_carried[i] + 1.0
                self._n_lost[i] = keep * self._n_lost[i] + float(not holds)

    # ------------------------------------------------------------------------------------------------------- tell

    def evidence(self, goal: int) -> tuple[Evidence, ...]:
        """Return the newest evidence about a goal, oldest first."""
        return tuple(self._log[goal])

    def changed_epoch(self, goal: int) -> int | None:
        """Return the epoch in which a goal's most probable needs last changed; None where they never did."""
        return self._changed_epoch[goal]

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return {
            "beliefs": [belief.state_dict() for belief in self.beliefs],
            "skill": list(self._skill),
            "n_carried": list(self._n_carried),
            "n_lost": list(self._n_lost),
            "changed_epoch": list(self._changed_epoch),
            "changed": list(self._changed),
            "log": [[msgspec.to_builtins(evidence) for evidence in kept] for kept in self._log],
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        for belief, loaded in zip(self.beliefs, state["beliefs"], strict=True):
            belief.load_state_dict(loaded)
        self._skill = list(state["skill"])
        self._n_carried = list(state["n_carried"])
        self._n_lost = list(state["n_lost"])
        self._changed_epoch = list(state["changed_epoch"])
        self._changed = tuple(state["changed"])
        for kept, loaded in zip(self._log, state["log"], strict=True):
            kept.clear()
            kept.extend(msgspec.convert(loaded, list[Evidence]))
        self._rng.bit_generator.state = state["rng"]


def _readings(goal: int, attempt: Attempt) -> tuple[int, ...]:
    """Return the goal-states that may have been in force when a goal came about, or did not.

    Where other goals came about in the same trial the order is unknown: before them, or after. Where a latched goal
    holds no longer (a thing was dropped) it is unknown which of the two counts.
    """
    before = mask(attempt.state)
    after = mask(attempt.state_after) & ~(1 << goal) | before & 1 << goal
    lost = 0 if attempt.holds is None else before & ~mask(attempt.holds)
    return tuple(sorted({before, after, before & ~lost, after & ~lost}))
