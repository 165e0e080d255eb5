"""What the virtual robot says of programs that fail or are none, and where in their text."""

import struct

import numpy as np
import pytest

from sim_twin.controller.states import RuntimeState
from tests.support.virtual_robot import FOREVER, ended, lines, make_robot, run, started, state_of

STOPPED, PLAYING = RuntimeState.STOPPED, RuntimeState.PLAYING


def test_a_program_that_fails_tells_its_line_on_the_primary_port():
    robot = started("def f():\n sync()\n movej([1, 2])\nend\n")
    ended(robot)
    assert any("program f, thread f, line 3" in line for line in lines(robot))
    said = [message for message in robot.machine.journal.outbox if b"movej" in message]
    assert [message.split(b"movej")[0][-8:] for message in said] == [struct.pack(">II", 3, 2)]


def test_a_text_that_does_not_parse_is_reported_and_harms_nothing():
    robot = started(FOREVER)
    robot.submit_script("def f():\n if\nend\n")
    run(robot, 3)
    assert state_of(robot) is PLAYING
    assert any("line 3, column 1: expected a value, got 'end'" in line for line in lines(robot))
    assert robot.machine.journal.outbox[-1].endswith(b"syntax_error_on_line:3:end:")


@pytest.mark.parametrize(
    ("text", "name", "line", "column"),
    [
        ("def illegal_fun():\n  calldoesntexist()\nend", "calldoesntexist", 2, 3),
        ("def f():\n movej([0, -1, 1, 0, 0, 0])\n foo(1)\nend\n", "foo", 3, 2),
        ("def f():\n sync()\n if False:\n  foo(1)\n end\nend\n", "foo", 4, 3),
        ("def f():\n def g():\n  return 1 + missing\n end\n sync()\nend\n", "missing", 3, 14),
        ("def f():\n sync()\n h = run nobody()\nend\n", "nobody", 3, 10),
        ("sec s():\n foo()\nend\n", "foo", 2, 2),
    ],
)
def test_a_name_that_nothing_has_is_reported_with_its_place_and_nothing_starts(text, name, line, column):
    robot = make_robot()
    run(robot, 3)
    before = robot.machine.world.data.qpos[:6].copy()
    robot.submit_script(text)
    run(robot, 200)
    said = list(robot.machine.journal.outbox)
    assert len(said) == 1
    assert said[0].endswith(struct.pack(">II", line, column) + f"compile_error_name_not_found:{name}:".encode())
    assert state_of(robot) is STOPPED
    assert np.abs(robot.machine.world.data.qpos[:6] - before).max() < 1e-4
    assert not any("STARTED" in line for line in lines(robot))


def test_a_secondary_program_that_fails_says_so_as_a_robot_does():
    robot = make_robot()
    robot.submit_script("sec side():\n set_digital_out(99, True)\nend\n")
    run(robot, 3)
    place = struct.pack(">II", 2, 2)
    words = b"SECONDARY_PROGRAM_EXCEPTION_XXXset_digital_out(): expected"
    assert place + words in robot.machine.journal.outbox[-1]


def test_a_sec_that_takes_time_is_reported():
    robot = make_robot()
    robot.submit_script("sec slow():\n sleep(1)\nend\n")
    run(robot, 2)
    assert any("physical time" in line for line in lines(robot))
