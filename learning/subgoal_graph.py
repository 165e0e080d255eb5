"""The sub-goal selector `graph`: learns what each goal needs, and plans backwards from the wanted one.

Each goal has a posterior over its preconditions (learning/preconditions.py). While learning, one conjunction is drawn
per goal (Thompson sampling), so that what is doubtful is tried as often as it is probable; when tested, the most
probable ones hold. The plan is the cheapest path over goal-states (learning/planning.py); its first step is chosen.
Before that, curiosity may try out what is doubtful (learning/curiosity.py). The softmax temperature has no part in
this: exploration dies out as the posterior sharpens, and wakes with surprise.
"""

from typing import Any

import numpy as np

from config.learning import SubgoalSelection
from learning.controls import Spot
from learning.curiosity import Curiosity, most_hopeful_step
from learning.graph import Graph, situation_of
from learning.interfaces import Attempt, GoalState, TrialOutcome
from learning.preconditions import Situation, mask

__all__ = ["GraphSelector"]

N_WALKS = 20
WALK = 6
FRESH = 0.85
"""How much of the memory of failures is left after each later trial."""
FORGOTTEN = 0.01
NOVICE = 0.2
"""What a failure counts for before the first success: who tries again in the same place learns the skill there."""
N_DRAWS = 6
"""Draws tried before a goal counts as out of reach in this goal-state."""


class GraphSelector:
    """Bayesian preconditions and planning. Goals are indices; nothing else is known of them."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection, rng: np.random.Generator) -> None:
        self._rng = rng
        self.graph = Graph(n_goals=n_goals, config=config)
        self._curiosity = Curiosity(config=config, rng=rng)
        self._failures: dict[Spot, float] = {}
        """How often a goal failed in a situation, of late."""
        self._changed: tuple[int, ...] = ()

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return the first step of the plan for a goal; what was achieved but is available again counts as not on."""
        del temperature
        if not any(available):
            raise ValueError("expected at least one available sub-goal, got none")
        here = Situation(mask(state) & ~mask(available), mask(state))
        step = self._explore(goal, here) if explore else self._exploit(goal, here)
        return step if available[step] else available.index(True)

    def _exploit(self, goal: int, here: Situation) -> int:
        """Return the first step of the most probable plan, or the goal itself where there is none."""
        plan = self.graph.plan(goal, here)
        return plan[0] if plan else goal

    def _explore(self, goal: int, here: Situation) -> int:
        """Return a step out of curiosity, else the first step of a plan under drawn needs.

        Where the goal seems out of reach, anything is tried that the drawn needs allow: there is nothing to lose.
        """
        step = self._curiosity.step(goal, here, self.graph)
        if step is not None:
            return step
        if not self.graph.is_known(goal, here):
            return most_hopeful_step(
                goal, here, self.graph, n_walks=N_WALKS, length=WALK, rng=self._rng, failures=self._failures
            )
        needs_of = self.graph.draw(self._rng)
        for _ in range(N_DRAWS):
            plan = self.graph.plan(goal, here, needs_of)
            if plan:
                return plan[0]
            needs_of = self.graph.draw(self._rng)
        missing = [i for i in range(self.graph.n_goals) if not here.holds >> i & 1]
        allowed = [i for i in missing if needs_of(i).allow(here)] or missing
        return allowed[int(self._rng.integers(len(allowed)))]

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. Void attempts change nothing."""
        findings = self.graph.learn(attempt)
        self._remember_failure(attempt)
        for finding in findings:
            self._curiosity.take_in(finding, self.graph)
        revised = {i for finding in findings if finding.is_revised for i in self.graph.dependents(finding.goal)}
        self._changed = tuple(sorted(revised))

    def _remember_failure(self, attempt: Attempt) -> None:
        if attempt.outcome is TrialOutcome.VOID:
            return
        self._failures = {spot: FRESH * n for spot, n in self._failures.items() if n > FORGOTTEN}
        if attempt.outcome is not TrialOutcome.ACHIEVED:
            at = (attempt.subgoal, situation_of(attempt))
            counted = 1.0 if self.graph.beliefs[attempt.subgoal].was_achieved else NOVICE
            self._failures[at] = self._failures.get(at, 0.0) + counted

    def grow(self, n_goals: int) -> None:
        """Take in new goals, and be curious about what they may have to do with the others."""
        self.graph.grow(n_goals)
        self._curiosity.wake()

    def changed_goals(self) -> tuple[int, ...]:
        """Return the goals for which what they need, directly or not, was revised by the last update."""
        return self._changed

    def predict_allowed(self, goal: int, state: GoalState) -> float:
        """Return the probability that a goal can come about in a goal-state."""
        return self.graph.beliefs[goal].predict_allowed(Situation(mask(state), mask(state)))

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return {
            "graph": self.graph.state_dict(),
            "curiosity": self._curiosity.state_dict(),
            "failures": [[goal, list(situation), n] for (goal, situation), n in self._failures.items()],
            "changed": list(self._changed),
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.graph.load_state_dict(state["graph"])
        self._curiosity.load_state_dict(state["curiosity"])
        self._failures = {(goal, Situation(*situation)): n for goal, situation, n in state["failures"]}
        self._changed = tuple(state["changed"])
        self._rng.bit_generator.state = state["rng"]
