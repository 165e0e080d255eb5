"""Faults that were asked for: how they end, and what they say where nothing comes of them."""

import pytest

from sim_twin.controller import faults as module
from sim_twin.controller.faults import LOOK_S, Faults
from sim_twin.controller.states import Event, RuntimeState
from tests.support.virtual_robot import FOREVER, make_robot, run, started, state_of


class FakeTime:
    def __init__(self):
        self.now_s = 0.0

    def monotonic(self):
        return self.now_s

    def sleep(self, duration_s):
        self.now_s += duration_s


@pytest.fixture
def clock(monkeypatch):
    clock = FakeTime()
    monkeypatch.setattr(module, "time", clock)
    return clock


def test_a_slice_that_is_late_for_long_is_ended_at_the_next_look(clock):
    faults, looks = Faults(None, None, None), []

    def look():
        looks.append(clock.now_s)
        if len(looks) == 3:
            faults.late_ticks()

    faults.late_ticks(ms=10_000.0)
    faults.delay(look)
    assert clock.now_s == pytest.approx(3 * LOOK_S)
    faults.delay(look)
    assert clock.now_s == pytest.approx(3 * LOOK_S), "it is over"


@pytest.mark.parametrize("ms", [0.5, 20.0, 1e3 * LOOK_S])
def test_a_short_delay_is_slept_as_one_and_every_so_often(clock, ms):
    faults, looks = Faults(None, None, None), []
    faults.late_ticks(ms=ms, every=4)
    slept = []
    for _ in range(8):
        faults.delay(lambda: looks.append(None))
        slept.append(clock.now_s)
    assert slept == pytest.approx([1e-3 * ms * n for n in (0, 0, 0, 1, 1, 1, 1, 2)])
    assert looks == []


def test_a_long_delay_that_nobody_ends_takes_its_time(clock):
    faults = Faults(None, None, None)
    faults.late_ticks(ms=730.0)
    faults.delay(lambda: None)
    assert clock.now_s == pytest.approx(0.73)


JOG = {"rad": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]}


@pytest.mark.parametrize("event", [Event.ROBOT_ESTOP, Event.PROTECTIVE_STOP, Event.SAFEGUARD_OPENED, Event.POWER_OFF])
def test_a_jog_of_an_arm_that_is_stopped_is_refused_and_says_so(event):
    robot = make_robot()
    robot.programs.handle(event)
    answer = Faults(robot, None, None).apply("jog", **JOG)
    assert answer["refusal"].startswith("jog: no program can start in mode")
    run(robot, 20)
    assert robot.programs.main is None


def test_a_jog_takes_the_place_of_what_runs_and_refuses_nothing():
    robot = started(FOREVER)
    before = robot.machine.drive.measured.q_rad[0]
    assert "refusal" not in Faults(robot, None, None).apply("jog", **JOG)
    run(robot, 2000, lambda: robot.programs.main is not None and robot.programs.main.name == "jog")
    run(robot, 2000, lambda: state_of(robot) is RuntimeState.STOPPED)
    assert robot.machine.drive.measured.q_rad[0] - before == pytest.approx(0.1, abs=2e-3)
