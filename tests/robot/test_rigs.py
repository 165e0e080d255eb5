import msgspec
import pytest

from config.loader import resolve
from perception.ground_truth import GroundTruthPerception
from robot.errors import RobotConfigError
from robot.hal.fake import FakePlant
from robot.local_station import LocalStation
from robot.rigs import build_operator, build_plant, build_station, load
from sim_twin.operator import SimulatedOperator
from tests.support.stations import fake_rig

RESOLVED = fake_rig()


def test_import_strings_name_what_they_load():
    assert load("robot.hal.fake:FakePlant") is FakePlant
    assert load("perception.ground_truth:GroundTruthPerception") is GroundTruthPerception


@pytest.mark.parametrize("wrong", ["robot.hal.fake:NoSuchPlant", "no.such.module:Plant", "robot"])
def test_an_import_string_that_leads_nowhere_is_refused_with_the_string(wrong):
    with pytest.raises(RobotConfigError, match=wrong):
        load(wrong)


def test_a_rig_becomes_its_plant_and_operator():
    plant = build_plant(rig=RESOLVED.rig, arm=RESOLVED.arm, scenario=RESOLVED.scenario)
    assert isinstance(plant, FakePlant)
    assert isinstance(build_operator(RESOLVED.rig), SimulatedOperator)
    assert build_operator(msgspec.structs.replace(RESOLVED.rig, operator=None)) is None


def test_a_station_is_built_disarmed_and_touches_no_plant():
    plant = FakePlant(arm=RESOLVED.arm, scenario=RESOLVED.scenario, rig=RESOLVED.rig)
    station = build_station(RESOLVED, plant=plant)
    assert isinstance(station, LocalStation)
    assert station.state.mode == "disarmed"
    assert plant.arm.n_commands == 0


def test_a_plant_with_another_tick_than_the_rig_is_refused():
    other = msgspec.structs.replace(RESOLVED.rig, tick_s=0.005)
    plant = FakePlant(arm=RESOLVED.arm, scenario=RESOLVED.scenario, rig=other)
    with pytest.raises(RobotConfigError, match="tick"):
        build_station(RESOLVED, plant=plant)


@pytest.mark.parametrize(
    ("key", "string", "word"),
    [
        ("plant", "os:getcwd", "class"),
        ("perception", "os:getcwd", "class"),
        ("operator", "os:getcwd", "class"),
        ("plant", "decimal:Decimal", "takes"),
        ("perception", "decimal:Decimal", "takes"),
    ],
)
def test_an_import_string_of_something_else_is_refused_and_never_called(key, string, word):
    resolved = msgspec.structs.replace(RESOLVED, rig=msgspec.structs.replace(RESOLVED.rig, **{key: string}))
    with pytest.raises(RobotConfigError, match=word):
        build_operator(resolved.rig) if key == "operator" else build_station(resolved)


@pytest.mark.parametrize("name", ["lab", "virtual_lab"])
def test_an_arm_at_an_address_is_never_held_in_the_learners_own_process(name):
    """A rig's copy without its bus had its station hold the client itself: nobody ended it with its link."""
    resolved = resolve(rig=name, scenario="paper", learning="default")
    assert resolved.rig.bus is not None
    rig = msgspec.structs.replace(resolved.rig, bus=None, address="127.0.0.2")
    with pytest.raises(RobotConfigError, match="expected a bus for the arm at"):
        build_station(msgspec.structs.replace(resolved, rig=rig))
