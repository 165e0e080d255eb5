import pytest

from config.rig import PlantExpected
from robot.errors import NotEngagedError, SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.safety import Arming, TooManyLatchesError

IDENTITY = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")


@pytest.fixture
def arming():
    return Arming(expected=PlantExpected(kind="fake", model="ur5e", serial="fake"), max_latches=2, latch_window=10)


def engage(arming):
    arming.arm(identity=IDENTITY, by="tester")
    arming.engage()


def latch_and_clear(arming, reason="why"):
    arming.latch(reason)
    arming.note_plant_reset()
    arming.clear_latch(identity=IDENTITY, by="tester")
    arming.engage()


def test_it_begins_disarmed_and_goes_by_armed_to_engaged(arming):
    modes = [arming.state.mode]
    arming.arm(identity=IDENTITY, by="tester")
    modes.append(arming.state.mode)
    arming.engage()
    modes.append(arming.state.mode)
    assert modes == [StationMode.DISARMED, StationMode.ARMED, StationMode.ENGAGED]


@pytest.mark.parametrize(
    "other",
    [
        PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="fake"),
        PlantIdentity(kind=PlantKind.FAKE, model="ur10e", serial="fake"),
        PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="20235500001"),
    ],
)
def test_another_plant_than_the_rig_names_is_not_armed(arming, other):
    with pytest.raises(SafetyError, match=r"the rig names plant fake/ur5e/fake, found"):
        arming.arm(identity=other, by="tester")
    assert arming.state.mode is StationMode.DISARMED


def test_nobody_is_not_enough_to_arm(arming):
    with pytest.raises(SafetyError, match="answer"):
        arming.arm(identity=IDENTITY, by="")


def test_motion_needs_an_engaged_station(arming):
    for prepare in (lambda: None, lambda: arming.arm(identity=IDENTITY, by="tester")):
        prepare()
        with pytest.raises(NotEngagedError):
            arming.require_engaged()
    arming.engage()
    arming.require_engaged()


def test_a_latch_keeps_its_first_reason(arming):
    engage(arming)
    arming.latch("first")
    arming.latch("second")
    assert arming.state.reason == "first"
    assert arming.reasons == ["first"]
    assert arming.n_latches == 1
    with pytest.raises(NotEngagedError, match="first"):
        arming.require_engaged()


def test_a_latch_is_cleared_only_after_the_plants_reset(arming):
    engage(arming)
    arming.note_plant_reset()
    arming.latch("why")
    with pytest.raises(SafetyError, match="reset the plant"):
        arming.clear_latch(identity=IDENTITY, by="tester")
    arming.note_plant_reset()
    assert arming.state.mode is StationMode.LATCHED
    arming.clear_latch(identity=IDENTITY, by="tester")
    assert arming.state.mode is StationMode.ARMED
    assert arming.state.reason == ""


@pytest.mark.parametrize("way_out", [lambda a: a.arm(identity=IDENTITY, by="tester"), lambda a: a.engage()])
def test_a_latch_has_no_other_way_out(arming, way_out):
    engage(arming)
    arming.latch("why")
    with pytest.raises(SafetyError):
        way_out(arming)
    arming.disarm()
    assert arming.state.mode is StationMode.LATCHED


def test_too_many_latches_fail_the_run(arming):
    engage(arming)
    latch_and_clear(arming)
    latch_and_clear(arming)
    with pytest.raises(TooManyLatchesError, match="at most 2 latches in 10 resets, came 3"):
        latch_and_clear(arming)
    assert arming.state.mode is StationMode.LATCHED


def test_disarming_takes_motion_away(arming):
    engage(arming)
    arming.disarm()
    assert arming.state.mode is StationMode.DISARMED
    assert not arming.is_engaged


def test_latches_long_ago_are_not_held_against_a_run(arming):
    engage(arming)
    for _ in range(12):
        arming.latch("bump")
        for _ in range(6):
            arming.note_plant_reset()
        arming.clear_latch(identity=IDENTITY, by="tester")
        arming.engage()
    latch_and_clear(arming)
    assert arming.n_latches == 13
    arming.latch("again")
    arming.note_plant_reset()
    with pytest.raises(TooManyLatchesError, match="at most 2 latches in 10 resets, came 3"):
        arming.clear_latch(identity=IDENTITY, by="tester")
