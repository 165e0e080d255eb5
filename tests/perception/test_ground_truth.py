import math

import msgspec
import pytest

from perception.ground_truth import GroundTruthPerception
from robot.errors import RobotConfigError
from robot.messages import GripState, ObjectPose, SceneState
from tests.support.stations import arm_state, fake_rig

RESOLVED = fake_rig()
SCENARIO, ARM = RESOLVED.scenario, RESOLVED.arm
TCP = (0.42, 0.05, 0.2)
NAMES = [e.name for e in (*SCENARIO.buttons, *SCENARIO.boxes, *SCENARIO.cylinders)]
PLACES = {name: (0.3 + 0.02 * i, -0.1 * i, 0.01 * i) for i, name in enumerate(NAMES)}
SCENE = SceneState(
    stamp_ns=7,
    objects=tuple(ObjectPose(name=n, position_m=p, quat=(1.0, 0.0, 0.0, 0.0)) for n, p in PLACES.items()),
)
STATE = arm_state(tuple(ARM.home_rad), stamp_ns=7, tcp_m=TCP)


def perceive(state=STATE, scene=SCENE, scenario=SCENARIO):
    return GroundTruthPerception(scenario=scenario, arm=ARM).perceive(state, scene)


def test_distances_are_euclidean_in_the_scenarios_order():
    seen = perceive()
    for name, d in zip(SCENARIO.distances, seen.distances_m, strict=True):
        if name != "table":
            assert d == pytest.approx(math.dist(TCP, PLACES[name]))


def test_the_tables_distance_is_the_height_over_it():
    scenario = msgspec.structs.replace(SCENARIO, table=msgspec.structs.replace(SCENARIO.table, height_m=0.05))
    seen = perceive(scenario=scenario)
    assert seen.distances_m[SCENARIO.distances.index("table")] == pytest.approx(0.15)


def test_the_order_of_the_scenes_objects_does_not_matter():
    shuffled = msgspec.structs.replace(SCENE, objects=SCENE.objects[::-1])
    assert perceive(scene=shuffled).distances_m == perceive().distances_m


@pytest.mark.parametrize("i", range(len(SCENARIO.buttons)))
def test_a_button_reads_as_lit_by_its_lamps_read_back(i):
    lit = msgspec.structs.replace(STATE, digital_out=1 << SCENARIO.buttons[i].lamp_output)
    assert perceive(lit).button_states == tuple(1.0 if k == i else 0.0 for k in range(len(SCENARIO.buttons)))
    pressed = msgspec.structs.replace(STATE, digital_in=1 << SCENARIO.buttons[i].input)
    assert sum(perceive(pressed).button_states) == 0.0


def test_truth_has_no_age_and_is_valid():
    seen = perceive()
    n = len(SCENARIO.distances) + len(SCENARIO.buttons)
    assert seen.ages_s == (0.0,) * n
    assert seen.valid == (True,) * n
    assert [(o.name, o.position_m) for o in seen.objects] == list(PLACES.items())


def test_stamp_tool_and_grip_are_the_arms():
    held = msgspec.structs.replace(STATE, grip=GripState(opening_m=0.044, is_moving=False, has_object=True))
    seen = perceive(held)
    assert (seen.stamp_ns, seen.tcp_position_m, seen.grip) == (7, TCP, held.grip)


def test_a_plant_without_truth_is_refused():
    with pytest.raises(RobotConfigError, match="ground truth"):
        perceive(scene=None)


def test_a_scene_that_lacks_a_thing_is_refused_by_name():
    with pytest.raises(RobotConfigError, match="red_box"):
        perceive(scene=SceneState(stamp_ns=7, objects=tuple(o for o in SCENE.objects if o.name != "red_box")))
