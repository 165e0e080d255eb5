"""Experts that are worse than they were: in a share of trials the arm strays, whatever they ask, and nobody is told.

It goes about at travel height, from where nothing is pressed or grabbed: such a trial fails for lack of skill, so the
chance of success becomes that share of what it was. Experts learn from it as they would from a worn gear.
"""

import hashlib
import math
from typing import Any

import numpy as np

from learning.interfaces import Experts, GoalState, Grows, Late, TrialOutcome
from learning.seeds import named_generator
from robot.messages import Heading, Percept, StationSpec, StepResult

__all__ = ["StrayingExperts"]

STEPS_A_WAY = 8
"""Time steps for which it strays the same way."""


class StrayingExperts:
    """Stands before experts (learning.interfaces.Experts) and lets the arm stray in some trials.

    Which ones, and where to, is drawn from the seed, the sub-goal and the percept that a trial begins with: so it needs
    no memory, and is the same for a run that was stopped, for one that was not and in whatever process it is tested.

    Args:
        experts: that are asked.
        spec: how far a step goes, and how high travel is.
        share: of trials in which the arm does what they ask.
        seed: root seed of the run.
    """

    def __init__(self, experts: Experts, spec: StationSpec, *, share: float, seed: int) -> None:
        self._experts = experts
        self._share = share
        self._seed = int(named_generator(seed, "straying").integers(2**63))
        self._step_m, self._height_m = spec.max_step_m, spec.heights_m[1]
        self._rng = np.random.default_rng(self._seed)
        self.is_straying = False
        """Whether the trial in hand is one of those."""
        self._n_steps = 0
        self._heading_rad = 0.0

    @property
    def is_exploring(self) -> bool:
        """Whether curiosity chose the newest intent."""
        return self._experts.is_exploring

    def begin_trial(self, subgoal: int, percept: Percept, *, explore: bool) -> None:
        """Start a trial, and draw whether the arm strays in it."""
        self._experts.begin_trial(subgoal, percept, explore=explore)
        self._rng = np.random.default_rng([self._seed, subgoal, *_words(percept)])
        self.is_straying = bool(self._rng.random() >= self._share)
        self._n_steps = 0

    def act(self, percept: Percept) -> Heading:
        """Return the next intent: what the experts ask, or the next step astray."""
        asked = self._experts.act(percept)
        if not self.is_straying:
            return asked
        if self._n_steps % STEPS_A_WAY == 0:
            self._heading_rad = float(self._rng.uniform(-math.pi, math.pi))
        self._n_steps += 1
        return Heading(heading_rad=self._heading_rad, distance_m=self._step_m, height_m=self._height_m)

    def observe(self, result: StepResult, achieved: GoalState) -> None:
        """Let the experts see what the step came to, as if it were of what they asked."""
        self._experts.observe(result, achieved)

    def end_trial(self, outcome: TrialOutcome, *, is_fair: bool = True, late: Late | None = None) -> None:
        """Close the trial."""
        self._experts.end_trial(outcome, is_fair=is_fair, late=late)

    def utility(self, subgoal: int, percept: Percept) -> float:
        """Return what the experts expect."""
        return self._experts.utility(subgoal, percept)

    def skill(self, subgoal: int) -> float:
        """Return what the experts measured."""
        return self._experts.skill(subgoal)

    def grow(self, n_goals: int) -> None:
        """Let the experts take in new goals."""
        assert isinstance(self._experts, Grows), "an expert set does"
        self._experts.grow(n_goals)

    def state_dict(self) -> dict[str, Any]:
        """Return the experts' state; there is no other."""
        return self._experts.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore the experts bit for bit."""
        self._experts.load_state_dict(state)


def _words(percept: Percept) -> tuple[int, ...]:
    """Return what a percept's places come to, as four 32-bit words of their digest."""
    places = np.array([*percept.distances_m, *percept.tcp_position_m], dtype="<f8")
    digest = hashlib.sha256(places.tobytes()).digest()
    return tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))
