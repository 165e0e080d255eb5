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


class Losing:
    """A resetter in whose hands the arm is lost so many times."""

    def __init__(self, station, n_losses):
        self._station, self._reset, self.n_left = station, station._world.resetter.reset, n_losses

    def __call__(self, **asked):
        self._reset(**asked)
        if self.n_left:
            self.n_left -= 1
            self._station._arming.latch("lost while the table was laid out")


def losing(resolved, monkeypatch, n_losses):
    station = build_station(resolved)
    monkeypatch.setattr(station._world.resetter, "reset", Losing(station, n_losses))
    return station


def test_an_arm_that_is_lost_while_the_table_is_laid_out_is_armed_again(resolved, monkeypatch):
    station = losing(resolved, monkeypatch, 1)
    with OperatedStation(station, build_operator(resolved.rig)) as operated:
        operated.reset(seed=1, epoch=0)
        assert (operated.state.mode, station.n_latches) == (StationMode.ENGAGED, 1)
        assert not operated.step(Hold()).is_void


def test_an_arm_that_is_lost_at_every_reset_fails_the_run(resolved, monkeypatch):
    station = losing(resolved, monkeypatch, 10**6)
    with (
        OperatedStation(station, build_operator(resolved.rig)) as operated,
        pytest.raises(TooManyLatchesError, match="laid out"),
    ):
        operated.reset(seed=1, epoch=0)


def test_a_reset_without_an_operator_arms_nothing_again(resolved, monkeypatch):
    station = losing(resolved, monkeypatch, 1)
    build_operator(resolved.rig).arm_once(station)
    with station, pytest.raises(NotEngagedError, match="laid out"):
        OperatedStation(station, None).reset(seed=1, epoch=0)


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
