import pytest

from robot.hal.fake import FakePlant
from robot.messages import ArmCommand, ArmMode, GripCommand
from tests.support.stations import fake_rig

RESOLVED = fake_rig()


@pytest.fixture
def plant():
    made = FakePlant(arm=RESOLVED.arm, scenario=RESOLVED.scenario, rig=RESOLVED.rig)
    made.arm.connect()
    return made


def shut(plant, n):
    arm = plant.arm
    grip = GripCommand(opening_m=0.0, force_n=60.0, speed_m_s=0.15)
    arm.write(ArmCommand(stamp_ns=0, sequence=1, q_rad=arm.read().q_rad, grip=grip, digital_out=0))
    for _ in range(n):
        arm.clock.wait_tick()
    return arm.read().grip


def test_the_hand_stops_on_what_lies_between_the_jaws_and_says_so(plant):
    plant.arm.held_opening_m = 0.044
    assert shut(plant, 5).has_object is False
    grip = shut(plant, 60)
    assert grip.opening_m == pytest.approx(0.044)
    assert grip.has_object
    assert not grip.is_moving


def test_a_stop_goes_on_holding_what_is_held(plant):
    plant.arm.held_opening_m = 0.044
    shut(plant, 60)
    plant.arm.stop()
    for _ in range(20):
        plant.arm.clock.wait_tick()
    assert plant.arm.read().grip.has_object


def test_an_object_that_is_gone_lets_the_jaws_meet(plant):
    plant.arm.held_opening_m = 0.044
    shut(plant, 60)
    plant.arm.held_opening_m = None
    grip = shut(plant, 60)
    assert grip.opening_m == pytest.approx(0.0)
    assert not grip.has_object


def test_inputs_force_and_mode_read_as_set(plant):
    plant.arm.digital_in = 0b101
    plant.arm.force_n = (1.0, 2.0, 3.0)
    plant.arm.mode = ArmMode.PROTECTIVE_STOP
    state = plant.arm.read()
    assert (state.digital_in, state.tcp_force_n, state.mode) == (0b101, (1.0, 2.0, 3.0), ArmMode.PROTECTIVE_STOP)


def test_things_are_where_they_are_moved_and_unknown_ones_are_refused(plant):
    plant.truth.move("red_cylinder", (0.3, 0.1, 0.03))
    assert next(o.position_m for o in plant.truth.read().objects if o.name == "red_cylinder") == (0.3, 0.1, 0.03)
    with pytest.raises(KeyError, match="teapot"):
        plant.truth.move("teapot", (0.0, 0.0, 0.0))
