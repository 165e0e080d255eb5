"""What one goal is believed to need: a posterior over conjunctions of literals on the other goals.

A literal says of another goal that it must be on, or must be off. Sets of goals are bit masks here: bit i is goal i.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import msgspec
import numpy as np

__all__ = ["START", "Belief", "Evidence", "Likelihood", "Needs", "Situation", "conjunctions", "mask"]


class Situation(NamedTuple):
    """Where an epoch stands. A thing taken and dropped is latched but holds no longer."""

    holds: int
    """Goals that hold: what must be on must be here."""
    latched: int
    """Goals achieved at some time in the epoch: what must be off must not be here."""

    def after(self, goal: int, undone: int = 0) -> "Situation":
        """Return the situation after a goal was achieved and others were lost by it."""
        return Situation(self.holds & ~undone | 1 << goal, self.latched | 1 << goal)


START = Situation(0, 0)


class Needs(NamedTuple):
    """One conjunction: the goals that must be on and those that must be off, as bit masks."""

    on: int
    off: int

    def allow(self, situation: Situation) -> bool:
        """Whether the goal may come about in a situation."""
        return not self.on & ~situation.holds and not self.off & situation.latched


class Likelihood(msgspec.Struct, frozen=True, kw_only=True):
    """How surely an attempt's result tells whether the goal was allowed."""

    p_hit: float
    """Chance that an attempt succeeds where the goal is allowed."""
    false_positive: float
    """Chance that it succeeds where the goal is not allowed."""


class Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """One attempt as far as preconditions go."""

    epoch: int
    is_achieved: bool
    readings: tuple[Situation, ...]
    """Situations that may have been in force; more than one where what happened can be read in several ways."""


def mask(state: Sequence[bool]) -> int:
    """Return a tuple of flags as a bit mask."""
    return sum(1 << i for i, is_on in enumerate(state) if is_on)


def conjunctions(n_goals: int, goal: int, max_literals: int) -> Iterator[Needs]:
    """Yield every conjunction of up to so many literals on goals other than this one, fewest literals first."""
    others = [i for i in range(n_goals) if i != goal]
    for n_literals in range(min(max_literals, len(others)) + 1):
        for members in combinations(others, n_literals):
            for signs in product((True, False), repeat=n_literals):
                on = sum(1 << i for i, is_on in zip(members, signs, strict=True) if is_on)
                yield Needs(on, sum(1 << i for i in members) - on)


class Belief:
    """The posterior of one goal, Bayes' rule with a change hazard.

    The prior of a conjunction is exp(-cost · literals), normalised. Before each update the posterior is mixed with the
    prior at the hazard: so often the needs are taken to have been drawn anew since the last attempt.
    """

    def __init__(self, *, n_goals: int, goal: int, max_literals: int, literal_cost: float) -> None:
        needs = tuple(conjunctions(n_goals, goal, max_literals))
        self._on = np.array([c.on for c in needs], dtype=np.int64)  # (h,)
        self._off = np.array([c.off for c in needs], dtype=np.int64)  # (h,)
        n_literals = np.array([(c.on | c.off).bit_count() for c in needs])
        weights = np.exp(-literal_cost * n_literals)
        self._prior = weights / weights.sum()
        self._n_goals = n_goals
        self._believe(self._prior.copy())

    def allows(self, situation: Situation) -> np.ndarray:
        """Return which conjunctions allow the goal in a situation.  () -> (h,)"""
        return ((self._on & ~situation.holds) | (self._off & situation.latched)) == 0

    def _believe(self, probabilities: np.ndarray) -> None:
        self.probabilities = probabilities
        """Posterior, in the order of `conjunctions`.  (h,)"""
        best = int(np.argmax(probabilities))
        self.most_probable = self._needs(best)
        """The most probable conjunction, of fewest literals among equals."""
        self.confidence = float(probabilities[best])
        """Its probability."""

    def mix_with_prior(self, hazard: float) -> None:
        """Take the needs to have been drawn anew with this chance."""
        self._believe((1.0 - hazard) * self.probabilities + hazard * self._prior)

    def update(self, evidence: Evidence, likelihood: Likelihood, *, weight: float = 1.0) -> float:
        """Apply Bayes' rule to one attempt and return the chance that had been given to its result.

        Where the situation can be read in more than one way, success is likely if any reading allows the goal (the
        trial goes on until it does); failure is averaged over the readings.

        Args:
            evidence: the attempt.
            likelihood: how telling it is.
            weight: power that the likelihood is raised to; below 1 for evidence that is not independent.
        """
        allowed = np.stack([self.allows(situation) for situation in evidence.readings])  # (readings, h)
        p_hit, fp = likelihood.p_hit, likelihood.false_positive
        if evidence.is_achieved:
            factors = np.where(allowed.any(axis=0), p_hit, fp)
        else:
            factors = np.where(allowed, 1.0 - p_hit, 1.0 - fp).mean(axis=0)
        expected = float(self.probabilities @ factors)
        posterior = self.probabilities * factors**weight
        self._believe(posterior / posterior.sum())
        return expected

    def sample(self, rng: np.random.Generator) -> Needs:
        """Draw a conjunction from the posterior."""
        cumulated = np.cumsum(self.probabilities)
        return self._needs(int(np.searchsorted(cumulated, rng.random() * cumulated[-1], side="right")))

    def predict_allowed(self, situation: Situation) -> float:
        """Return the probability that the goal is allowed in a situation."""
        return float(self.probabilities @ self.allows(situation))

    def marginals(self) -> tuple[tuple[float, float], ...]:
        """Return for each goal the probability that it must be on, and that it must be off."""
        bits = 1 << np.arange(self._n_goals, dtype=np.int64)
        on = self.probabilities @ ((self._on[:, None] & bits) != 0)  # (h,) @ (h, n) -> (n,)
        off = self.probabilities @ ((self._off[:, None] & bits) != 0)
        return tuple(zip(on.tolist(), off.tolist(), strict=True))

    def _needs(self, index: int) -> Needs:
        index = min(index, len(self._on) - 1)
        return Needs(int(self._on[index]), int(self._off[index]))

    def state_dict(self) -> dict[str, Any]:
        """Return the posterior."""
        return {"probabilities": self.probabilities.copy()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._believe(np.array(state["probabilities"], dtype=float))
