import math

import numpy as np
import pytest

from config.learning import Actions
from config.loader import load_scenario
from learning.actions import Candidates, heading_of
from tests.support.kinematic_table import KinematicTable

SPEC = KinematicTable(load_scenario("paper")).spec


def test_candidates_are_every_heading_and_length_at_both_heights_and_staying_put():
    asked = Candidates(SPEC, Actions(n_headings=4, distance_shares=(1.0, 0.5))).asked()
    assert len(asked) == 2 * (1 + 4 * 2)
    assert sorted({row[2] for row in asked.tolist()}) == sorted(SPEC.heights_m)
    lengths = np.hypot(asked[:, 0], asked[:, 1]) / SPEC.max_step_m
    assert sorted({round(float(length), 6) for length in lengths}) == [0.0, 0.5, 1.0]


def test_a_turn_turns_every_heading_by_the_same_angle():
    candidates = Candidates(SPEC, Actions(n_headings=4, distance_shares=(1.0,)))
    level, turned = candidates.asked()[1:5], candidates.asked(0.125)[1:5]
    before = np.arctan2(level[:, 1], level[:, 0])
    after = np.arctan2(turned[:, 1], turned[:, 0])
    assert np.cos(after - before - 0.125 * 2.0 * math.pi) == pytest.approx(np.ones(4))


def test_turning_leaves_the_grid_itself_as_it_was():
    candidates = Candidates(SPEC, Actions())
    before = candidates.asked().copy()
    candidates.asked(0.3)
    assert (candidates.asked() == before).all()


def test_a_row_becomes_the_intent_it_describes():
    intent = heading_of(np.array([0.0, 0.02, 0.1]))
    assert (intent.heading_rad, intent.distance_m, intent.height_m) == pytest.approx((math.pi / 2, 0.02, 0.1))
