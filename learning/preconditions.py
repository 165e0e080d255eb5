"""What one goal is believed to need: a posterior over conjunctions of literals on the other goals.

A literal says of another goal that it must be on, or must be off. Sets of goals are bit masks here: bit i is goal i.
"""

from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import combinations, product
from typing import Any, NamedTuple

import msgspec
import numpy as np

from learning.allowed_mass import AllowedMass
from learning.one_change import LISTED, OneChange, one_change

__all__ = ["START", "Belief", "Evidence", "Kind", "Needs", "Situation", "conjunctions", "mask", "one_change_apart"]


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
WORD = 31
"""Bits of a word for what must be on; as many for what must be off lie above them."""
MOST = (1 << WORD) - 1
MOST_KEPT = 4096
"""Predictions that are kept until a belief changes."""


class Needs(NamedTuple):
    """One conjunction: the goals that must be on and those that must be off, as bit masks."""

    on: int
    off: int

    def allow(self, situation: Situation) -> bool:
        """Whether the goal may come about in a situation."""
        return not self.on & ~situation.holds and not self.off & situation.latched


FORGET = 0.95
"""How much of the record of hits and misses is left after each later attempt: a skill grows, or is lost."""


class Kind(StrEnum):
    """How an attempt ended."""

    ACHIEVED = "achieved"
    BLOCKED = "blocked"
    """At the place, to no effect."""
    MISSED = "missed"
    """The place was not reached: for want of skill, or because there was nothing to be had."""


class Evidence(msgspec.Struct, frozen=True, kw_only=True):
    """One attempt as far as preconditions go."""

    epoch: int
    kind: Kind
    readings: tuple[Situation, ...]
    """Situations that may have been in force; more than one where what happened can be read in several ways."""


def mask(state: Sequence[bool]) -> int:
    """Return a tuple of flags as a bit mask."""
    return sum(1 << i for i, is_on in enumerate(state) if is_on)


def one_change_apart(needs: Needs, n_goals: int, goal: int, max_literals: int) -> Iterator[Needs]:
    """Yield what becomes of a conjunction by one change: a literal more, one fewer, one turned round, one exchanged."""
    others = [1 << i for i in range(n_goals) if i != goal]
    free = [bit for bit in others if not (needs.on | needs.off) & bit]
    more = [way for bit in free for way in (Needs(bit, 0), Needs(0, bit))]
    if (needs.on | needs.off).bit_count() < max_literals:
        yield from (Needs(needs.on | way.on, needs.off | way.off) for way in more)
    for bit in others:
        if (needs.on | needs.off) & bit:
            without = Needs(needs.on & ~bit, needs.off & ~bit)
            yield without
            yield Needs(needs.on ^ bit, needs.off ^ bit)
            yield from (Needs(without.on | way.on, without.off | way.off) for way in more)


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

    The prior of a conjunction is exp(-cost · literals), normalised. Before an update the needs are taken to have
    changed since the last attempt with a small chance, the hazard: some of those changes draw them anew from the prior,
    the others change one literal of what was believed. Who moves a wire on a table leaves the rest as it was.

    An attempt fails for want of skill or for want of what is needed, and only together do they explain a record. So
    each conjunction has a skill of its own: the share of hits, Beta(1, 1) and forgetting, where it allowed the goal. If
    every miss fell where a conjunction says no, that one needs no clumsy expert to explain them, and gains. A change of
    one literal takes the record along, for the expert is the same; what is drawn anew begins with an empty one.

    A miss speaks only for what must be on: without the thing that is to be put somewhere there may be no way to the
    place. What must be off shows itself at the place, where the attempt is blocked; misses with something else in the
    way, such as a full hand, would be taken for it.
    """

    def __init__(
        self, *, n_goals: int, goal: int, max_literals: int, literal_cost: float, false_positive: float
    ) -> None:
        self._goal, self._max_literals, self._literal_cost = goal, max_literals, literal_cost
        needs = tuple(conjunctions(n_goals, goal, max_literals))
        self._on = np.array([c.on for c in needs], dtype=np.int64)  # (h,)
        self._off = np.array([c.off for c in needs], dtype=np.int64)  # (h,)
        n_literals = np.array([(c.on | c.off).bit_count() for c in needs])
        weights = np.exp(-literal_cost * n_literals)
        self._prior = weights / weights.sum()
        self._words = self._on | self._off << WORD  # (h,)
        self._one_change = _one_change(needs, n_goals, goal, max_literals)
        is_many = len(needs) > LISTED
        self._mass = AllowedMass(n_goals=n_goals, goal=goal, max_literals=max_literals) if is_many else None
        """For many conjunctions; few are multiplied out, so that what was reported of them stays bit for bit."""
        self._n_goals = n_goals
        self._false_positive = false_positive
        self._hits = np.zeros(len(needs))  # (h,)
        self._misses = np.zeros(len(needs))  # (h,)
        self._believe(self._prior.copy())

    def grown(self, n_goals: int) -> "Belief":
        """Return what is believed where there are so many goals; these are the first of them.

        Of literals on new goals nothing is known: a conjunction with some has the probability of what else it says,
        times exp(-cost) for each, as the prior has it, and the record of that.
        """
        new = Belief(
            n_goals=n_goals, goal=self._goal, max_literals=self._max_literals, literal_cost=self._literal_cost,
            false_positive=self._false_positive,
        )  # fmt: skip
        known = (1 << self._n_goals) - 1
        index_of = {word: i for i, word in enumerate(self._words.tolist())}
        at = [index_of[word] for word in (new._words & (known | known << WORD)).tolist()]  # (h',)
        n_new = np.array([(word & ~(known | known << WORD)).bit_count() for word in new._words.tolist()])  # (h',)
        weights = self.probabilities[at] * np.exp(-self._literal_cost * n_new)
        new._hits, new._misses = self._hits[at], self._misses[at]
        new._believe(weights / weights.sum())
        return new

    def allows(self, situation: Situation) -> np.ndarray:
        """Return which conjunctions allow the goal in a situation.  () -> (h,)"""
        missing = ~situation.holds & MOST | situation.latched << WORD
        return (self._words & missing) == 0

    def _provides(self, situation: Situation) -> np.ndarray:
        """Return in which conjunctions all that must be on is on.  () -> (h,)"""
        return (self._on & ~situation.holds) == 0

    def _believe(self, probabilities: np.ndarray) -> None:
        self.probabilities = probabilities
        """Posterior, in the order of `conjunctions`.  (h,)"""
        best = int(np.argmax(probabilities))
        self.most_probable = self._needs(best)
        """The most probable conjunction, of fewest literals among equals."""
        self.confidence = float(probabilities[best])
        """Its probability."""
        self._predicted: dict[Situation, float] = {}
        self._marginals: tuple[tuple[float, float], ...] | None = None
        self._is_hit: bool | None = None
        self._successes: np.ndarray | None = None
        """What was worked out already of these probabilities and records."""

    def expect_change(self, hazard: float, *, local: float = 0.0) -> None:
        """Take the needs to have changed.

        Args:
            hazard: chance that they did.
            local: share of the changes that are of one literal; the others draw from the prior.
        """
        leaving = hazard * local * self.probabilities / self._one_change.n_changes  # (h,)
        arriving = self._one_change.arriving
        changed = arriving(leaving)
        kept = (1.0 - hazard) * self.probabilities
        mixed = kept + changed + hazard * (1.0 - local) * self._prior
        for record in (self._hits, self._misses):
            brought = kept * record + arriving(leaving * record)
            np.divide(brought, mixed, out=record, where=mixed > 0.0)
        self._believe(mixed / mixed.sum())

    def update(self, evidence: Evidence, *, block_hit: float, weight: float = 1.0) -> float:
        """Apply Bayes' rule to one attempt and return the chance that had been given to its result.

        Where the situation can be read in more than one way, failure is averaged over the readings. Success is likely
        if what was on at any time of the trial allows the goal (the trial goes on until it does), averaged over
        whether what was dropped counts as on.

        Args:
            evidence: the attempt.
            block_hit: chance that an attempt which came to the place succeeds where the goal is allowed.
            weight: power that the likelihood is raised to; below 1 for evidence that is not independent.
        """
        permits = self._provides if evidence.kind is Kind.MISSED else self.allows
        allowed = np.stack([permits(situation) for situation in evidence.readings])  # (readings, h)
        ever_allowed = _ever(allowed, evidence.readings)  # (1 or 2, h)
        fp, chance = self._false_positive, self._skills()  # (), (h,)
        match evidence.kind:
            case Kind.ACHIEVED:
                factors = np.where(ever_allowed, np.maximum(chance, fp), fp).mean(axis=0)
            case Kind.BLOCKED:
                factors = np.where(allowed, 1.0 - block_hit, 1.0 - fp).mean(axis=0)
            case Kind.MISSED:
                factors = np.where(allowed, 1.0 - chance, 1.0 - fp).mean(axis=0)
        expected = float(self.probabilities @ factors)
        posterior = self.probabilities * factors**weight
        self._believe(posterior / posterior.sum())
        self._record(evidence.kind, ever_allowed.mean(axis=0), weight)
        self._is_hit = None
        return expected

    def _record(self, kind: Kind, allowed: np.ndarray, weight: float) -> None:
        """Count a hit or a miss for every conjunction that allowed the goal. A block says nothing of the skill.

        Args:
            kind: how the attempt ended.
            allowed: chance that each conjunction allowed it.  (h,)
            weight: what a miss counts for.
        """
        if kind is Kind.BLOCKED:
            return
        is_counted = allowed > 0.0
        self._hits[is_counted] *= FORGET
        self._misses[is_counted] *= FORGET
        if kind is Kind.ACHIEVED:
            self._hits += allowed
        else:
            self._misses += weight * allowed

    def sample(self, rng: np.random.Generator) -> Needs:
        """Draw a conjunction from the posterior."""
        cumulated = np.cumsum(self.probabilities)
        return self._needs(int(np.searchsorted(cumulated, rng.random() * cumulated[-1], side="right")))

    def predict_allowed(self, situation: Situation) -> float:
        """Return the probability that the goal is allowed in a situation."""
        if situation not in self._predicted:
            if len(self._predicted) >= MOST_KEPT:
                self._predicted.clear()
            self._predicted[situation] = self._sum_allowed(self.probabilities, situation)
        return self._predicted[situation]

    def _sum_allowed(self, weights: np.ndarray, situation: Situation) -> float:
        """Return the sum of the weights of the conjunctions that allow the goal in a situation.  (h,) -> ()"""
        holds, latched = situation
        if self._mass is None or holds & ~latched:
            return float(weights @ self.allows(situation))
        return self._mass.of(weights, holds=holds, latched=latched)

    def predict_success(self, situation: Situation) -> float:
        """Return the chance of success in a situation: that the goal is allowed, and the skill where it is.

        Before the first success nothing is known of the skill, and misses are the expert's: it is left out.
        """
        if not self.was_achieved:
            return self.predict_allowed(situation)
        if self._mass is None:
            return float(self.probabilities @ (self.allows(situation) * self._skills()))
        if self._successes is None:
            self._successes = self.probabilities * self._skills()
        return self._sum_allowed(self._successes, situation)

    def _skills(self) -> np.ndarray:
        """Return each conjunction's skill, the mean of Beta(1 + hits, 1 + misses).  () -> (h,)"""
        return (self._hits + 1.0) / (self._hits + self._misses + 2.0)

    @property
    def was_achieved(self) -> bool:
        """Whether the goal was ever achieved."""
        if self._is_hit is None:
            self._is_hit = bool(self._hits.any())
        return self._is_hit

    def marginals(self) -> tuple[tuple[float, float], ...]:
        """Return for each goal the probability that it must be on, and that it must be off."""
        if self._marginals is None:
            self._marginals = self._work_out_marginals()
        return self._marginals

    def _work_out_marginals(self) -> tuple[tuple[float, float], ...]:
        if self._mass is not None:
            return tuple(self._mass.marginals(self.probabilities))
        bits = 1 << np.arange(self._n_goals, dtype=np.int64)
        on = self.probabilities @ ((self._on[:, None] & bits) != 0)  # (h,) @ (h, n) -> (n,)
        off = self.probabilities @ ((self._off[:, None] & bits) != 0)
        return tuple(zip(on.tolist(), off.tolist(), strict=True))

    def _needs(self, index: int) -> Needs:
        index = min(index, len(self._on) - 1)
        return Needs(int(self._on[index]), int(self._off[index]))

    def state_dict(self) -> dict[str, Any]:
        """Return the posterior and the record."""
        return {
            "probabilities": self.probabilities.copy(), "hits": self._hits.copy(), "misses": self._misses.copy(),
        }  # fmt: skip

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._hits, self._misses = np.array(state["hits"], dtype=float), np.array(state["misses"], dtype=float)
        self._believe(np.array(state["probabilities"], dtype=float))


def _one_change(needs: Sequence[Needs], n_goals: int, goal: int, max_literals: int) -> OneChange:
    """Return the sums over what is one change apart."""
    index_of = {conjunction: i for i, conjunction in enumerate(needs)}
    return one_change(
        needs,
        lambda i: [index_of[n] for n in one_change_apart(needs[i], n_goals, goal, max_literals)],
        n_others=n_goals - 1, max_literals=max_literals,
    )  # fmt: skip


def _ever(allowed: np.ndarray, readings: Sequence[Situation]) -> np.ndarray:
    """Return what was allowed at any time of a trial, in a row for each way to read what was dropped.

    Args:
        allowed: by reading.  (readings, h)
        readings: the situations; where what was dropped counts as on, all that is latched holds.
    """
    counts_as_on = np.array([reading.holds == reading.latched for reading in readings])
    rows = [allowed[part].any(axis=0) for part in (counts_as_on, ~counts_as_on) if part.any()]
    return np.stack(rows)
