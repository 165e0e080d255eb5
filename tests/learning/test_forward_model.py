import math

import numpy as np
import pytest

from config.learning import ForwardModel
from config.loader import load_scenario
from learning.forward_model import GeometricModel, shaped
from robot.messages import Heading
from tests.support.kinematic_table import KinematicTable


@pytest.fixture
def table() -> KinematicTable:
    return KinematicTable(load_scenario("paper"))


def test_one_step_goes_straight_towards_what_is_asked_by_hand():
    asked = np.array([[0.03, 0.0, 0.24], [0.01, 0.0, 0.2], [0.0, 0.0, 0.2]])
    # From 0.2 m up: (30, 0, 40) mm is 50 mm long and shrinks to 20; (10, 0, 0) stays; nothing stays nothing.
    expected = [[0.012, 0.0, 0.016], [0.01, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert shaped(asked, 0.2, 0.02) == pytest.approx(np.array(expected))


def test_the_prediction_is_where_the_arm_comes_to_rest(table):
    percept = table.reset(seed=4, epoch=0)
    model = GeometricModel(ForwardModel(), table.spec, np.random.default_rng(0))
    model.begin(percept)
    intent = Heading(heading_rad=1.0, distance_m=0.02, height_m=0.225)
    predicted = model.predict(np.array([[0.02 * math.cos(1.0), 0.02 * math.sin(1.0), 0.225]]))[0]
    result = table.step(intent)
    for _ in range(30):  # the arm trails its target: let it come to rest
        result = table.step(Heading(heading_rad=0.0, distance_m=0.0, height_m=float(table.target[2])))
    assert predicted == pytest.approx(result.percept.distances_m, abs=1e-4)


def test_a_far_prediction_is_the_distance_from_there(table):
    percept = table.reset(seed=4, epoch=0)
    model = GeometricModel(ForwardModel(), table.spec, np.random.default_rng(0))
    model.begin(percept)
    place = {thing.name: thing.position_m for thing in percept.objects}["green_button"]
    way = np.array([[place[0] - percept.tcp_position_m[0], place[1] - percept.tcp_position_m[1], place[2]]])
    predicted = dict(zip(table.spec.distance_names, model.predict(way, is_far=True)[0], strict=True))
    assert predicted["green_button"] == pytest.approx(0.0, abs=1e-6)
    assert predicted["table"] == pytest.approx(place[2])


def test_what_the_hand_holds_is_predicted_to_come_along(table):
    table.reset(seed=4, epoch=0)
    table.hold("blue_cylinder")
    percept = table.step(Heading(heading_rad=0.0, distance_m=0.0, height_m=0.225)).percept
    model = GeometricModel(ForwardModel(), table.spec, np.random.default_rng(0))
    model.begin(percept)
    i = table.spec.distance_names.index("blue_cylinder")
    predicted = model.predict(np.array([[0.1, 0.0, 0.1]]), is_far=True)[0]
    assert predicted[i] == percept.distances_m[i]


def test_a_step_that_was_cut_short_is_expected_to_be_so_again(table):
    percept = table.reset(seed=4, epoch=0)
    model = GeometricModel(ForwardModel(), table.spec, np.random.default_rng(0))
    model.begin(percept)
    down = Heading(heading_rad=0.0, distance_m=0.0, height_m=0.025)
    for _ in range(8):
        model.observe(down, table.step(down), is_learning=False)
    height = table.spec.distance_names.index("table")
    fall = table.target[2] - model.predict(np.array([[0.0, 0.0, 0.025]]))[0, height]
    assert fall == pytest.approx(0.25 * 0.05, abs=1e-6)  # guarded speed times a step
