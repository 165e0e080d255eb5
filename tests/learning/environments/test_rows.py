"""A percept as numbers and numbers as an intent: what a network of others sees and asks for."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from learning.environments.rows import FARTHEST_M, asked, intent_of, is_achieved, n_observed, observed, one_goal
from robot.messages import GripState, ObjectPercept, Percept, StationSpec

SPEC = StationSpec(
    n_distances=2, n_buttons=1, distance_names=("a", "table"), step_s=0.05, max_step_m=0.02, heights_m=(0.02, 0.2),
    workspace_m=((0.2, -0.4, 0.0), (0.6, 0.4, 0.3)),
)  # fmt: skip
SHARE = st.floats(-1.0, 1.0)


def percept(**changed):
    told = {
        "stamp_ns": 0, "distances_m": (0.1, 0.2), "button_states": (1.0,), "ages_s": (0.0,) * 3,
        "valid": (True, False, True), "tcp_position_m": (0.4, -0.1, 0.2), "is_in_contact": True,
        "objects": (ObjectPercept(name="a", position_m=(0, 0, 0), quat=(1, 0, 0, 0), age_s=0.0, is_valid=True),),
        "grip": GripState(opening_m=0.05, is_moving=False, has_object=True),
    }  # fmt: skip
    return Percept(**(told | changed))


def test_a_percept_is_told_in_order():
    row = observed(percept())
    assert row.tolist() == pytest.approx([0.1, 0.2, 1, 1, 0, 1, 0.4, -0.1, 0.2, 0.05, 0, 1, 1])
    assert (len(row), row.dtype) == (n_observed(SPEC), np.float32)


@pytest.mark.parametrize(
    ("distance_m", "told_m"), [(FARTHEST_M, FARTHEST_M), (math.nextafter(FARTHEST_M, 9), FARTHEST_M)]
)
def test_what_is_farther_than_can_be_told_is_told_as_that_far(distance_m, told_m):
    assert observed(percept(distances_m=(distance_m, 0.0)))[0] == told_m


@given(SHARE, SHARE, SHARE)
def test_no_action_asks_for_more_than_one_step_or_another_height_than_there_is(x, y, height):
    intent = intent_of(np.array([x, y, height]), SPEC)
    assert 0.0 <= intent.distance_m <= SPEC.max_step_m
    assert SPEC.heights_m[0] <= intent.height_m <= SPEC.heights_m[1] * (1 + 1e-12)
    if math.hypot(x, y) < 1.0:
        assert intent.distance_m * math.cos(intent.heading_rad) == pytest.approx(x * SPEC.max_step_m, abs=1e-12)
        assert intent.distance_m * math.sin(intent.heading_rad) == pytest.approx(y * SPEC.max_step_m, abs=1e-12)


@pytest.mark.parametrize(
    ("action", "distance_m", "height_m"),
    [([0, 0, -1], 0.0, 0.02), ([1, 0, 1], 0.02, 0.2), ([1, 1, 0], 0.02, 0.11), ([0, -0.5, 0], 0.01, 0.11)],
)
def test_an_action_is_a_displacement_and_a_height(action, distance_m, height_m):
    intent = intent_of(np.array(action, dtype=float), SPEC)
    assert (intent.distance_m, intent.height_m) == pytest.approx((distance_m, height_m))


@pytest.mark.parametrize("action", [[math.nan, 0, 0], [0, math.inf, 0], [0, 0], [0, 0, 0, 0]])
def test_what_is_no_action_is_refused(action):
    with pytest.raises(ValueError, match="expected 3 finite numbers"):
        intent_of(np.array(action, dtype=float), SPEC)


@pytest.mark.parametrize(
    ("achieved", "desired", "is_so"),
    [
        ((1, 0, 0), (1, 0, 0), True),
        ((1, 1, 0), (1, 0, 0), True),
        ((0, 1, 0), (1, 0, 0), False),
        ((1, 0, 0), (1, 1, 0), False),
        ((0, 0, 0), (0, 0, 0), False),
        ((1, 1, 1), (0, 0, 0), False),
    ],
)
def test_a_goal_is_achieved_where_all_that_is_wanted_came_about(achieved, desired, is_so):
    assert is_achieved(np.array(achieved), np.array(desired)) == is_so
    assert is_achieved(np.array([achieved] * 2), np.array([desired] * 2)).tolist() == [is_so] * 2


def test_goals_are_rows_of_nought_and_one():
    assert asked((True, False)).tolist() == [1.0, 0.0]
    assert one_goal(1, 3).tolist() == [0.0, 1.0, 0.0]
