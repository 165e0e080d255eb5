"""What of a station only a plant made for tests can show: pushes, stops, silence, objects that slip away."""

import pytest

from robot.errors import NotEngagedError, StaleStateError
from robot.messages import ArmMode, Grip, GripState, Heading, Hold, StationMode
from robot.rigs import build_station
from tests.support.stations import engaged as engage_fake
from tests.support.stations import fake_rig


def go(angle=0.0, distance=0.022, height=0.2, **more):
    return Heading(heading_rad=angle, distance_m=distance, height_m=height, **more)


@pytest.fixture
def fake():
    resolved = fake_rig()
    station, plant = engage_fake(resolved)
    yield station, plant, resolved
    station.close()


def test_a_push_latches_and_voids_the_step(fake):
    station, plant, _ = fake
    station.step(Hold())
    plant.arm.force_n = (0.0, 0.0, 300.0)
    result = station.step(go())
    assert result.is_void
    assert result.verdicts[0].reason == "force"


@pytest.mark.parametrize("mode", [ArmMode.PROTECTIVE_STOP, ArmMode.EMERGENCY_STOP, ArmMode.STOPPED, ArmMode.IDLE])
def test_a_stop_of_the_arm_itself_latches_and_voids_the_step(fake, mode):
    station, plant, _ = fake
    plant.arm.mode = mode
    result = station.step(go())
    assert result.is_void
    assert result.verdicts[0].reason == "arm_mode"
    assert station.state.mode is StationMode.LATCHED


def test_an_arm_that_falls_silent_latches_and_voids_the_step(fake):
    station, plant, _ = fake
    plant.arm.is_silent = True
    result = station.step(go())
    assert result.is_void
    assert result.verdicts[0].reason == "stale_state"
    assert plant.arm.n_stops > 0


def test_a_station_that_never_connected_lets_go_of_what_its_loop_holds(monkeypatch):
    resolved = fake_rig()
    station = build_station(resolved)
    n_closed = []
    monkeypatch.setattr(station.loop, "close", lambda: n_closed.append(1))
    station.close()
    assert n_closed == [1]


def test_a_table_that_cannot_be_seen_when_the_arm_is_taken_latches_it(fake, monkeypatch):
    station, plant, _ = fake
    n_stops = plant.arm.n_stops

    def blind():
        raise StaleStateError("no truth")

    with monkeypatch.context() as dark:
        dark.setattr(plant.truth, "read", blind)
        with pytest.raises(StaleStateError):
            station.reset(seed=1, epoch=1)
    assert station.state.mode is StationMode.LATCHED
    assert plant.arm.n_stops > n_stops
    with pytest.raises(NotEngagedError, match="no truth"):
        station.step(go())


@pytest.mark.parametrize("moment", ["step", "reset"])
def test_what_is_lost_is_on_the_read_out_before_the_arm_is_stopped_for_it(fake, monkeypatch, moment):
    """A stop that is seen to its end takes longer than telling may."""
    station, plant, _ = fake
    shown, stop = [], station.loop.stop

    def note():
        shown.append(station.state)
        stop()

    def blind():
        raise StaleStateError("no truth")

    monkeypatch.setattr(station.loop, "stop", note)
    monkeypatch.setattr(plant.truth, "read", blind)
    if moment == "step":
        assert station.step(go()).is_void
    else:
        with pytest.raises(StaleStateError):
            station.reset(seed=1, epoch=1)
    assert [(state.mode, "no truth" in state.reason) for state in shown] == [(StationMode.LATCHED, True)]


def test_a_held_object_that_is_lost_voids_the_step_without_latching(fake):
    station, plant, _ = fake
    plant.arm.held_opening_m = 0.044
    for _ in range(12):
        result = station.step(Hold(grip=Grip.CLOSE))
    assert result.percept.grip.has_object
    plant.arm.held_opening_m = None
    results = [station.step(Hold(grip=Grip.CLOSE)) for _ in range(4)]
    lost = [r for r in results if r.is_void]
    assert len(lost) == 1
    assert "object_lost" in lost[0].executed.limiters
    assert station.state.mode is StationMode.ENGAGED


def test_pressing_lights_the_lamp_and_switches_the_lid_and_the_epoch_forgets(fake):
    station, plant, resolved = fake
    green, red = resolved.scenario.buttons[1], resolved.scenario.boxes[0]
    assert station.step(go()).percept.button_states == (0.0, 0.0, 0.0)
    plant.arm.digital_in = 1 << green.input
    station.step(go())
    plant.arm.digital_in = 0
    assert station.step(go()).percept.button_states == (0.0, 1.0, 0.0)
    assert plant.arm.read().digital_out & 1 << red.lid.output
    assert station.reset(seed=1, epoch=1).button_states == (0.0, 0.0, 0.0)
    assert not plant.arm.read().digital_out & 1 << red.lid.output


def test_a_reflex_holds_the_arm_while_the_fingers_move(fake):
    station, plant, _ = fake
    x, y, z = plant.arm.read().tcp_position_m
    plant.truth.move("red_cylinder", (x, y, z - 0.002))
    plant.arm.held_opening_m = 0.044
    station.step(Hold())
    result = station.step(go())
    assert "hand" in result.executed.limiters
    assert result.executed.target_m == pytest.approx((x, y, z), abs=1e-3)
    while "hand" in result.executed.limiters:
        result = station.step(go())
    assert result.percept.grip.has_object


def test_an_open_hand_in_the_percept_is_the_arms(fake):
    station, plant, _ = fake
    grip = station.step(Hold()).percept.grip
    assert isinstance(grip, GripState)
    assert grip == plant.arm.read().grip
