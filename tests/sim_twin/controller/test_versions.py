"""What a program may call at an announced version: no more than that version has."""

import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.builtins.versions import ANY, SINCE
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.states import RuntimeState
from sim_twin.controller.wire import ControllerVersion
from tests.support.virtual_robot import make_robot, run, state_of

MASSES = "def f():\n m = get_mass_matrix()\n while m[0, 0] > 0:\n  sync()\n end\nend\n"
OLDEST = {3: (3, 0, 0), 5: (5, 0, 0)}


@pytest.fixture(scope="module")
def robot():
    return make_robot()


def version_of(numbers):
    major, minor, bugfix = (*numbers, 0, 0)[:3]
    return ControllerVersion(major=major, minor=minor, bugfix=bugfix)


def names_at(robot, numbers):
    robot.machine.version = version_of(numbers)
    return set(program_builtins(robot.machine, Sockets(slice_s=0.002)))


def just_before(numbers):
    """Return the highest version below: one bugfix less, or the minor version before with all its bugfixes."""
    major, minor, bugfix = (*numbers, 0, 0)[:3]
    return (major, minor, bugfix - 1) if bugfix else (major, minor - 1, 99)


@pytest.mark.parametrize("announced", [(3, 15, 8), (5, 11), (5, 22, 3)], ids=str)
def test_a_function_of_a_later_version_is_refused_by_name_as_a_robot_refuses_it(announced):
    robot = make_robot(version=version_of(announced))
    robot.submit_script(MASSES)
    run(robot, 20)
    assert state_of(robot) is RuntimeState.STOPPED
    said = list(robot.machine.journal.outbox)
    assert len(said) == 1
    assert said[0].endswith(b"compile_error_name_not_found:get_mass_matrix:")


def test_at_its_own_version_it_runs():
    robot = make_robot(version=version_of((5, 23)))
    robot.submit_script(MASSES)
    run(robot, 20, lambda: state_of(robot) is RuntimeState.PLAYING)
    run(robot, 20)
    assert state_of(robot) is RuntimeState.PLAYING, list(robot.machine.journal.lines)


@pytest.mark.parametrize("name", SINCE)
def test_every_function_comes_with_its_version_and_not_before(robot, name):
    for major, since in zip((5, 3), SINCE[name], strict=True):
        if since is None:
            assert name not in names_at(robot, (major, 99))
        elif since == ANY:
            assert name in names_at(robot, OLDEST[major])
        else:
            assert name in names_at(robot, since)
            assert name not in names_at(robot, just_before(since))


def test_what_no_client_tells_a_version_of_is_there_at_every_one(robot):
    newest = names_at(robot, (5, 99))
    assert names_at(robot, OLDEST[5]) | SINCE.keys() == newest
    assert names_at(robot, OLDEST[3]) | SINCE.keys() == newest
