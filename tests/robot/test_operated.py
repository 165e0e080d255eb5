"""Who arms a station in an unattended run, and how the world's own time is told."""

import pytest

from config.loader import resolve
from robot.errors import NotEngagedError
from robot.messages import Heading, Hold, StationMode
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_plant, build_station
from robot.safety import TooManyLatchesError
from robot.timed import time_world

NAN = Heading(heading_rad=float("nan"), distance_m=0.0, height_m=0.2)


@pytest.fixture
def resolved():
    return resolve(rig="fake")


def test_an_operator_arms_once_and_the_station_closes_disarmed(resolved):
    with OperatedStation(build_station(resolved), build_operator(resolved.rig)) as station:
        assert station.state.mode is StationMode.ENGAGED
        station.connect()
        assert station.state.mode is StationMode.ENGAGED
        percept = station.reset(seed=1, epoch=0)
        assert station.step(Hold()).percept.stamp_ns > percept.stamp_ns
        assert station.spec.n_distances == len(resolved.scenario.distances)
    assert station.state.mode is StationMode.DISARMED


def test_a_latch_is_cleared_at_the_next_reset_and_not_before(resolved):
    with OperatedStation(build_station(resolved), build_operator(resolved.rig)) as station:
        station.reset(seed=1, epoch=0)
        assert station.step(NAN).is_void
        assert station.state.mode is StationMode.LATCHED
        with pytest.raises(NotEngagedError):
            station.step(Hold())
        station.reset(seed=2, epoch=1)
        assert station.state.mode is StationMode.ENGAGED
        assert not station.step(Hold()).is_void


def test_a_reset_after_a_latch_is_the_reset_that_would_have_been(resolved):
    with OperatedStation(build_station(resolved), build_operator(resolved.rig)) as station:
        expected = station.reset(seed=2, epoch=1)
        station.step(NAN)
        again = station.reset(seed=2, epoch=1)
    assert again.distances_m == expected.distances_m


def test_too_many_latches_fail_the_run(resolved):
    with OperatedStation(build_station(resolved), build_operator(resolved.rig)) as station:
        for epoch in range(resolved.rig.max_latches + 1):
            station.reset(seed=epoch, epoch=epoch)
            station.step(NAN)
        with pytest.raises(TooManyLatchesError, match="at most"):
            station.reset(seed=0, epoch=0)


def test_without_an_operator_nothing_moves_until_a_person_arms(resolved):
    with OperatedStation(build_station(resolved), None) as station, pytest.raises(NotEngagedError):
        station.reset(seed=1, epoch=0)


def test_every_tick_is_told_as_stack_then_physics(resolved):
    laps = []
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    time_world(plant, laps.append)
    with OperatedStation(build_station(resolved, plant=plant), build_operator(resolved.rig)) as station:
        station.reset(seed=1, epoch=0)
        laps.clear()
        station.step(Hold())
        assert laps == ["stack", "physics"] * 5
        result = station.step(Hold())
        assert plant.arm.clock.now_ns() == result.percept.stamp_ns
