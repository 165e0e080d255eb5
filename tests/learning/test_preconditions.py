"""Beliefs about preconditions: the hypotheses, Bayes' rule by hand, readings, change."""

import math

import msgspec
import numpy as np
import pytest

from config.learning import SubgoalSelection
from learning.preconditions import START, Belief, Evidence, Kind, Needs, Situation, conjunctions, mask, one_change_apart

ACHIEVED, BLOCKED, MISSED = Kind.ACHIEVED, Kind.BLOCKED, Kind.MISSED
SURE = 0.95
"""Chance of success at the place."""


def belief(n_goals=3, goal=2, max_literals=2, literal_cost=1.2):
    return Belief(n_goals=n_goals, goal=goal, max_literals=max_literals, literal_cost=literal_cost, false_positive=0.02)


def state(*goals):
    bits = sum(1 << g for g in goals)
    return Situation(bits, bits)


def seen(kind, *readings):
    return Evidence(epoch=0, kind=kind, readings=readings)


@pytest.mark.parametrize(
    ("n_goals", "max_literals", "count"), [(6, 5, 243), (6, 3, 131), (12, 3, 1563), (2, 3, 3), (1, 3, 1)]
)
def test_there_are_as_many_conjunctions_as_choices_of_literals(n_goals, max_literals, count):
    found = list(conjunctions(n_goals, 0, max_literals))
    assert len(found) == len(set(found)) == count
    assert found[0] == Needs(0, 0)
    assert not any((needs.on | needs.off) & 1 or needs.on & needs.off for needs in found)


def test_the_prior_falls_by_the_cost_with_each_literal():
    b = belief(literal_cost=1.2)
    # One empty conjunction, 4 of one literal, 4 of two.
    total = 1 + 4 * math.exp(-1.2) + 4 * math.exp(-2.4)
    assert b.most_probable == Needs(0, 0)
    assert b.confidence == pytest.approx(1 / total)
    assert b.probabilities.sum() == pytest.approx(1.0)


def test_bayes_rule_by_hand():
    # Two goals: hypotheses {}, {0 on}, {0 off}. Blocked with nothing on: {} and {0 off} had predicted success.
    b = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    expected = b.update(seen(BLOCKED, START), block_hit=SURE)
    weights = {Needs(0, 0): 0.05, Needs(1, 0): 0.98, Needs(0, 1): 0.05}
    assert expected == pytest.approx(sum(weights.values()) / 3)
    assert b.confidence == pytest.approx(0.98 / 1.08)
    assert b.most_probable == Needs(on=1, off=0)
    assert b.predict_allowed(START) == pytest.approx(0.10 / 1.08)
    assert b.marginals()[0] == pytest.approx((0.98 / 1.08, 0.05 / 1.08))


def test_evidence_of_half_weight_moves_half_as_far_in_odds():
    whole, half = (belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0) for _ in range(2))
    whole.update(seen(BLOCKED, START), block_hit=SURE)
    for _ in range(2):
        half.update(seen(BLOCKED, START), block_hit=SURE, weight=0.5)
    assert half.probabilities == pytest.approx(whole.probabilities)


def test_a_failure_in_a_situation_of_two_readings_is_averaged_and_a_success_needs_only_one():
    ambiguous = (START, state(0))
    failed = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    failed.update(seen(BLOCKED, *ambiguous), block_hit=SURE)
    # {} is allowed in both readings (0.05), the literals in one of them: (0.05 + 0.98) / 2.
    assert failed.confidence == pytest.approx(0.515 / (0.05 + 2 * 0.515))
    achieved = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    achieved.update(seen(ACHIEVED, *ambiguous), block_hit=SURE)
    assert achieved.probabilities == pytest.approx([1 / 3] * 3)


def test_every_conjunction_has_a_skill_of_its_own():
    # Hypotheses {}, {0 on}, {0 off}. A hit with 0 on, then two misses with nothing on.
    b = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    b.update(seen(ACHIEVED, state(0)), block_hit=SURE)
    # Nothing is known of any skill yet: 1/2 where the goal was allowed, else a false positive.
    assert b.probabilities == pytest.approx(np.array([0.5, 0.5, 0.02]) / 1.02)
    b.update(seen(MISSED, START), block_hit=SURE)
    # {} has one hit in one trial, Beta(1, 1): 2/3; {0 off} none: 1/2; {0 on} needs no clumsy expert.
    weights = np.array([0.5 * (1 - 2 / 3), 0.5 * 0.98, 0.02 * 0.5])
    assert b.probabilities == pytest.approx(weights / weights.sum())
    b.update(seen(MISSED, START), block_hit=SURE)
    hits, misses = 0.95, 1.0
    weights *= np.array([1 - (hits + 1) / (hits + misses + 2), 0.98, 1 - 1 / 3])
    assert b.probabilities == pytest.approx(weights / weights.sum())


def test_an_expert_that_misses_everywhere_says_nothing_about_needs():
    b = belief(n_goals=2, goal=1, max_literals=1)
    before = b.probabilities.copy()
    for k in range(40):
        b.update(seen(MISSED, START if k % 2 else state(0)), block_hit=SURE)
    assert abs(b.probabilities - before).max() < 0.3
    assert b.predict_allowed(START) + b.predict_allowed(state(0)) > 1.0


def test_what_was_dropped_does_not_hold_but_is_latched():
    dropped = Situation(holds=0, latched=1)
    assert not Needs(on=1, off=0).allow(dropped)
    assert not Needs(on=0, off=1).allow(dropped)
    assert Needs(on=0, off=0).allow(dropped)


def test_vector_and_scalar_judgement_agree():
    b = belief(n_goals=4, goal=0, max_literals=3)
    every = list(conjunctions(4, 0, 3))
    for holds in range(16):
        for latched in range(16):
            situation = Situation(holds, latched)
            assert b.allows(situation).tolist() == [needs.allow(situation) for needs in every]


def test_the_hazard_mixes_with_the_prior():
    b = belief()
    prior = b.probabilities.copy()
    b.update(seen(ACHIEVED, state(0)), block_hit=SURE)
    sharp = b.probabilities.copy()
    b.expect_change(0.25)
    assert b.probabilities == pytest.approx(0.75 * sharp + 0.25 * prior)


def test_one_change_adds_removes_turns_round_or_exchanges_a_literal():
    # Goals 0 and 1 may be literals of goal 2.
    assert set(one_change_apart(Needs(0b01, 0), 3, 2, 2)) == {
        Needs(0, 0), Needs(0, 0b01), Needs(0b10, 0), Needs(0, 0b10), Needs(0b11, 0), Needs(0b01, 0b10),
    }  # fmt: skip
    assert set(one_change_apart(Needs(0, 0), 3, 2, 2)) == set(conjunctions(3, 2, 1)) - {Needs(0, 0)}
    assert all((n.on | n.off).bit_count() <= 1 for n in one_change_apart(Needs(0b01, 0), 3, 2, 1))


def test_what_is_one_change_apart_is_so_both_ways():
    every = list(conjunctions(4, 3, 2))
    apart = {c: set(one_change_apart(c, 4, 3, 2)) for c in every}
    assert all(len(list(one_change_apart(c, 4, 3, 2))) == len(apart[c]) for c in every)
    assert all((a in apart[b]) == (b in apart[a]) and a not in apart[a] for a in every for b in every)


def test_a_change_of_one_literal_by_hand_takes_the_record_of_skill_along():
    # Hypotheses {}, {0 on}, {0 off}, each one change from the two others.
    b = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    b.update(seen(ACHIEVED, state(0)), block_hit=SURE)
    before = b.probabilities.copy()  # (0.5, 0.5, 0.02) / 1.02, a hit for the first two.
    b.expect_change(0.1, local=1.0)
    after = 0.9 * before + 0.1 * (1.0 - before) / 2.0
    assert b.probabilities == pytest.approx(after)
    hits = np.array([0.9 * before[0] + 0.05 * before[1], 0.9 * before[1] + 0.05 * before[0], 0.05 * before[:2].sum()])
    chance = (hits / after + 1.0) / (hits / after + 2.0)
    assert b.predict_success(state(0)) == pytest.approx(float(after[:2] @ chance[:2]))
    assert b.predict_success(START) == pytest.approx(float(after[[0, 2]] @ chance[[0, 2]]))


def test_what_was_dropped_counts_as_on_in_half_of_a_success():
    # Goal 0 was achieved and lost when goal 1 came about: {0 on} explains it only if what was dropped counts as on.
    b = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    b.update(seen(ACHIEVED, Situation(0, 1), state(0)), block_hit=SURE)
    weights = np.array([0.5, (0.5 + 0.02) / 2.0, 0.02])
    assert b.probabilities == pytest.approx(weights / weights.sum())


def test_draws_follow_the_posterior():
    b = belief(n_goals=2, goal=1, max_literals=1, literal_cost=0.0)
    b.update(seen(BLOCKED, START), block_hit=SURE)
    rng = np.random.default_rng(0)
    share = sum(b.sample(rng) == Needs(1, 0) for _ in range(3000)) / 3000
    assert share == pytest.approx(0.98 / 1.08, abs=0.02)


def test_a_belief_survives_ten_thousand_contrary_surprises_without_losing_its_sum():
    b = belief()
    for i in range(10_000):
        b.expect_change(0.0)
        b.update(seen(ACHIEVED if i % 2 else BLOCKED, START), block_hit=SURE)
    assert np.isfinite(b.probabilities).all()
    assert b.probabilities.sum() == pytest.approx(1.0)


def test_a_mask_has_bit_i_for_goal_i():
    assert mask((True, False, True)) == 0b101


@pytest.mark.parametrize("n_goals", [1, 2, 4])
@pytest.mark.parametrize("literal_cost", [0.0, 20.0])
def test_a_belief_stays_one_at_the_ends_of_what_the_config_admits(n_goals, literal_cost):
    almost = float(np.nextafter(1.0, 0.0))
    for hazard, local in ((0.0, 0.0), (almost, 0.0), (0.0, almost), (almost, almost)):
        keys = {"max_literals": 1, "literal_cost": literal_cost, "hazard": hazard, "local_change": local}
        config = msgspec.convert(keys, SubgoalSelection)
        b = belief(n_goals=n_goals, goal=0, max_literals=config.max_literals, literal_cost=config.literal_cost)
        for _ in range(5):
            b.expect_change(config.hazard, local=config.local_change)
            b.update(seen(BLOCKED, START), block_hit=SURE)
        assert b.probabilities.sum() == pytest.approx(1.0)
        assert 0.0 < b.predict_success(START) <= 1.0
