"""rtde_set_watchdog: the strictest that is due acts, nothing due is forgotten, and time runs anew after a pause."""

import pytest

from sim_twin.controller.machine import Machine
from sim_twin.controller.robot import make_world
from sim_twin.controller.states import RuntimeState
from sim_twin.controller.watchdogs import WatchdogAction, Watchdogs
from sim_twin.controller.wire import ControllerVersion, input_fields
from tests.support.virtual_robot import lines, run, started, state_of

PAUSE, STOP, IGNORE = WatchdogAction.PAUSE, WatchdogAction.STOP, WatchdogAction.IGNORE
TURN = " while True:\n  speedj([0,0,0,0,0,0.3], 4, 0.002)\n end\nend\n"


def watching(*settings):
    """Return a robot that turns its wrist under watchdogs (register, Hz, action)."""
    calls = "".join(f' rtde_set_watchdog("input_int_register_{i}", {hz}, "{action}")\n' for i, hz, action in settings)
    return started(f"def f():\n{calls}{TURN}")


@pytest.mark.parametrize(("hz", "n"), [(10.0, 50), (50.0, 10), (500.0, 1), (2000.0, 1), (60.0, 9)])
@pytest.mark.parametrize("action", [PAUSE, STOP])
def test_a_watchdog_bites_in_the_slice_after_its_time_and_no_earlier(hz, n, action):
    dogs = Watchdogs()
    dogs.set("a", hz, action)
    assert [dogs.tick() for _ in range(n)] == [None] * n
    assert dogs.tick() == ("a", action)


def test_a_watchdog_that_is_set_again_in_every_slice_starves_all_the_same():
    dogs = Watchdogs()
    seen = []
    for _ in range(12):
        dogs.set("a", 50, STOP)
        seen.append(dogs.tick())
    assert seen == [*[None] * 10, ("a", STOP), None]


@pytest.mark.parametrize(("hz", "action"), [(100, STOP), (50, PAUSE)])
def test_another_rate_or_action_begins_the_time_anew(hz, action):
    dogs = Watchdogs()
    dogs.set("a", 50, STOP)
    assert [dogs.tick() for _ in range(10)] == [None] * 10
    dogs.set("a", hz, action)
    assert dogs.tick() is None


VERSION = ControllerVersion(minor=26)


@pytest.fixture(scope="module")
def machine():
    return Machine(make_world(), version=VERSION)


@pytest.mark.parametrize("name", sorted(input_fields(VERSION)))
def test_every_input_feeds_its_watchdog(machine, name):
    machine.watchdogs.clear()
    machine.watchdogs.set(name, 50, STOP)
    n_items = input_fields(VERSION)[name].n_items
    for _ in range(30):
        machine.writer(name)(0 if n_items == 1 else (0,) * n_items)
        assert machine.watchdogs.tick() is None
    assert [machine.watchdogs.tick() for _ in range(10)][-1] == (name, STOP)


def test_a_secondary_program_cannot_touch_the_watchdogs_of_the_one_that_moves():
    robot = watching((0, 10, "stop"))
    run(robot, 10)
    robot.submit_script('sec side():\n rtde_set_watchdog("input_int_register_0", 10, "ignore")\nend\n')
    run(robot, 60)
    assert any("rtde_set_watchdog(): a secondary program has no watchdogs" in line for line in lines(robot))
    assert robot.programs.main is None


@pytest.mark.parametrize("order", [1, -1])
def test_the_strictest_of_those_due_in_one_slice_acts(order):
    dogs = Watchdogs()
    for name, action in (("a", PAUSE), ("b", STOP), ("c", IGNORE))[::order]:
        dogs.set(name, 100, action)
    assert [dogs.tick() for _ in range(6)][-1] == ("b", STOP)
    assert dogs.tick() == ("a", PAUSE), "the other is still due"


def test_one_that_is_not_written_is_due_again_after_its_time():
    dogs = Watchdogs()
    dogs.set("a", 50, PAUSE)
    assert [k for k in range(1, 45) if dogs.tick()] == [11, 22, 33, 44]
    dogs.wrote("a")
    assert [dogs.tick() for _ in range(10)] == [None] * 10


@pytest.mark.parametrize("order", [1, -1])
def test_a_stop_and_a_pause_due_together_stop_the_program(order):
    robot = watching(*((0, 10, "stop"), (1, 10, "pause"))[::order])
    run(robot, 60)
    assert state_of(robot) in (RuntimeState.STOPPING, RuntimeState.STOPPED)
    assert robot.programs.main is None


def test_a_program_that_was_resumed_without_a_write_is_paused_again():
    robot = watching((0, 10, "pause"))
    for _ in range(3):
        n = run(robot, 60, lambda: state_of(robot) is RuntimeState.PAUSING)
        assert 40 <= n <= 52
        run(robot, 300, lambda: state_of(robot) is RuntimeState.PAUSED)
        robot.panel.play()
        run(robot, 2)
        assert state_of(robot) is RuntimeState.PLAYING
    for _ in range(10):
        run(robot, 20)
        robot.machine.writer("input_int_register_0")(1)
    assert state_of(robot) is RuntimeState.PLAYING


def test_a_slower_watchdog_outlives_the_pause_of_a_faster_one():
    robot = watching((0, 20, "pause"), (1, 10, "stop"))
    run(robot, 40, lambda: state_of(robot) is RuntimeState.PAUSING)
    run(robot, 300, lambda: state_of(robot) is RuntimeState.PAUSED)
    robot.panel.play()
    for _ in range(4):
        run(robot, 10)
        robot.machine.writer("input_int_register_0")(1)
    assert robot.programs.main is None
    assert any("input_int_register_1" in line and "stop" in line for line in lines(robot))
