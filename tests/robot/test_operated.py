"""Who arms a station in an unattended run, and how the world's own time is told."""

import msgspec
import pytest

from config.loader import resolve
from robot.errors import (
    ArmRefusedError,
    NotEngagedError,
    RobotConfigError,
    SafetyError,
    StaleStateError,
    WireError,
)
from robot.messages import Heading, Hold, StationMode
from robot.operated import MOST_FAILED, OperatedStation
from robot.rigs import build_operator, build_plant, build_station
from robot.safety import TooManyLatchesError
from robot.timed import time_world
from sim_twin.operator import SimulatedOperator

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
    station, paused_s = losing(resolved, monkeypatch, 10**6), []
    with (
        OperatedStation(station, build_operator(resolved.rig), pause=paused_s.append) as operated,
        pytest.raises(TooManyLatchesError, match="laid out"),
    ):
        operated.reset(seed=1, epoch=0)
    assert paused_s, "it was tried more than once, not without end"


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


class Lossy:
    """A loop that loses its arm at moments that it is told, each once, and otherwise does what the one in it does."""

    def __init__(self, loop):
        self._loop, self.why_lost = loop, None
        self.failures, self.n_stops = {}, 0

    def __getattr__(self, name):
        return getattr(self._loop, name)

    def _fail_at(self, moment):
        errors = self.failures.get(moment, [])
        if errors:
            raise errors.pop(0)

    def engage(self):
        self._fail_at("engage")
        self.why_lost = None
        self._loop.engage()

    def seed(self):
        self._fail_at("seed")
        return self._loop.seed()

    def begin_epoch(self, epoch):
        self._fail_at("begin_epoch")
        return self._loop.begin_epoch(epoch)

    def stop(self):
        self.n_stops += 1
        self._loop.stop()


class LosesAt:
    """Lays the table out, and the arm is lost meanwhile."""

    def __init__(self, resetter, loop):
        self._resetter, self._loop, self.n_losses, self.n = resetter, loop, 0, 0

    def reset(self, **layout):
        self.n += 1
        self._resetter.reset(**layout)
        if self.n_losses > 0:
            self.n_losses -= 1
            self._loop.why_lost = "arm_refused: the program was stopped"


class Lossful:
    """An operated station whose arm may be lost."""

    def __init__(self, resolved, operator):
        self.plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
        self.local = build_station(resolved, plant=self.plant)
        self.loop = self.local._loop = Lossy(self.local._loop)
        self.resetter = self.plant.resetter = LosesAt(self.plant.resetter, self.loop)
        self.pauses_s = []
        self.station = OperatedStation(self.local, operator, pause=self.pauses_s.append)


@pytest.fixture
def lossy(resolved):
    made = Lossful(resolved, build_operator(resolved.rig))
    with made.station:
        made.station.reset(seed=1, epoch=0)
        made.resetter.n = 0
        yield made


def assert_goes_on(lossy, *, n_latches):
    assert lossy.station.state.mode is StationMode.ENGAGED
    assert not lossy.station.step(Hold()).is_void
    assert lossy.local.n_latches == n_latches


@pytest.mark.parametrize("n", [1, 3])
def test_an_arm_that_stops_while_the_table_is_laid_out_is_armed_again_and_the_run_goes_on(lossy, n):
    lossy.resetter.n_losses = 2 * n - 1  # whoever arms again lays the table out as well, with no arm to lose
    lossy.station.reset(seed=2, epoch=1)
    assert_goes_on(lossy, n_latches=n)
    assert len(lossy.pauses_s) == n


FAILURES = [
    NotEngagedError("expected an engaged arm; engage and seed it first"),
    SafetyError("expected an engaged arm; engage and seed it first"),
    ArmRefusedError("the program that obeys has ended"),
    StaleStateError("no state"),
    WireError("nobody answers"),
]


@pytest.mark.parametrize("moment", ["begin_epoch", "engage", "seed"])
@pytest.mark.parametrize("error", FAILURES, ids=lambda e: type(e).__name__)
def test_a_reset_that_fails_for_a_lost_arm_is_a_latch_and_is_done_once_more(lossy, moment, error):
    lossy.loop.failures[moment] = [error]
    n_stops = lossy.loop.n_stops
    lossy.station.reset(seed=2, epoch=1)
    assert lossy.loop.n_stops > n_stops
    assert_goes_on(lossy, n_latches=1)


@pytest.mark.parametrize("moment", ["engage", "seed"])
def test_an_arm_that_is_lost_again_while_it_is_armed_again_is_armed_once_more(lossy, moment):
    lossy.loop.failures[moment] = [StaleStateError("no state")] * 8
    lossy.station.reset(seed=2, epoch=1)
    assert_goes_on(lossy, n_latches=8)


def test_a_wire_that_fails_while_latched_is_tried_again_and_its_error_ends_the_run_at_last(lossy):
    lossy.station.step(NAN)
    lossy.loop.failures["begin_epoch"] = [WireError("nobody answers")] * (MOST_FAILED - 1)
    lossy.station.reset(seed=2, epoch=1)
    assert_goes_on(lossy, n_latches=1)
    lossy.loop.failures["begin_epoch"] = [WireError("nobody answers")] * (1 + MOST_FAILED)  # the first latches
    with pytest.raises(WireError, match="nobody answers"):
        lossy.station.reset(seed=3, epoch=2)
    assert lossy.station.state.mode is StationMode.LATCHED


def test_stops_at_the_wrong_moment_count_as_latches_and_too_many_fail_the_run(resolved):
    rig = msgspec.structs.replace(resolved.rig, max_latches=2)
    lossy = Lossful(msgspec.structs.replace(resolved, rig=rig), build_operator(rig))
    with lossy.station as station:
        lossy.resetter.n_losses = 5
        with pytest.raises(TooManyLatchesError, match="at most 2 latches"):
            station.reset(seed=1, epoch=0)


def test_what_is_wrong_with_a_file_or_refused_by_the_operator_is_tried_once(lossy):
    lossy.loop.failures["engage"] = [RobotConfigError("another arm")]
    with pytest.raises(RobotConfigError):
        lossy.station.reset(seed=2, epoch=1)
    lossy.station.step(NAN)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimulatedOperator, "rearm", refuse)
        with pytest.raises(SafetyError, match="nobody is there"):
            lossy.station.reset(seed=2, epoch=1)
    assert lossy.pauses_s == []


def refuse(*_args, **_layout):
    raise SafetyError("nobody is there")


def test_without_an_operator_a_stop_at_the_wrong_moment_waits_for_a_person(resolved):
    lossy = Lossful(resolved, None)
    SimulatedOperator().arm_once(lossy.local)
    lossy.resetter.n_losses = 1
    with pytest.raises(NotEngagedError, match="the program was stopped"):
        lossy.station.reset(seed=1, epoch=0)
    assert lossy.station.state.mode is StationMode.LATCHED
    lossy.station.close()
