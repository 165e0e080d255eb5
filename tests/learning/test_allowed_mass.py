"""Sums over what a situation allows are those over all conjunctions, whichever way they are worked out."""

import numpy as np
import pytest

from learning import preconditions
from learning.preconditions import Belief, Evidence, Kind, Situation, conjunctions

N_GOALS, GOAL = 7, 3


@pytest.fixture
def ways(monkeypatch):
    """Return two beliefs of one goal that differ in how they add up."""

    def belief():
        return Belief(n_goals=N_GOALS, goal=GOAL, max_literals=3, literal_cost=1.0, false_positive=0.01)

    few = belief()
    monkeypatch.setattr(preconditions, "LISTED", 10)
    return few, belief()


def situations(rng, n):
    latched = rng.integers(1 << N_GOALS, size=n)
    holds = latched & rng.integers(1 << N_GOALS, size=n)
    return [Situation(int(a), int(b)) for a, b in zip(holds, latched, strict=True)]


def test_beliefs_predict_and_tell_the_same_either_way_while_they_learn(ways):
    rng = np.random.default_rng(0)
    kinds = (Kind.ACHIEVED, Kind.BLOCKED, Kind.MISSED)
    for epoch, situation in enumerate(situations(rng, 40)):
        evidence = Evidence(epoch=epoch, kind=kinds[rng.integers(3)], readings=(situation,))
        for belief in ways:
            belief.expect_change(0.01, local=0.9)
            belief.update(evidence, block_hit=0.9)
        few, many = ways
        assert np.allclose(few.marginals(), many.marginals(), atol=1e-12)
        for asked in situations(rng, 20):
            assert many.predict_allowed(asked) == pytest.approx(few.predict_allowed(asked), abs=1e-12)
            assert many.predict_success(asked) == pytest.approx(few.predict_success(asked), abs=1e-12)


def test_what_holds_and_was_never_achieved_allows_both_signs(ways):
    few, many = ways
    odd = Situation(0b101, 0b001)
    assert many.predict_allowed(odd) == pytest.approx(few.predict_allowed(odd), abs=1e-12)


def test_a_sum_is_of_the_conjunctions_that_are_allowed_and_of_no_other():
    belief = Belief(n_goals=N_GOALS, goal=GOAL, max_literals=3, literal_cost=1.0, false_positive=0.01)
    mass = preconditions.AllowedMass(n_goals=N_GOALS, goal=GOAL, max_literals=3)
    needs = list(conjunctions(N_GOALS, GOAL, 3))
    for situation in situations(np.random.default_rng(1), 10):
        for k in (0, 1, 50, len(needs) - 1):
            one = np.zeros(len(needs))
            one[k] = 1.0
            told = mass.of(one, holds=situation.holds, latched=situation.latched)
            assert told == needs[k].allow(situation) == belief.allows(situation)[k]
