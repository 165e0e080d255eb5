"""What the primary port says of the safety mode: each change once, and before each stop the error that it has."""

import struct

import pytest

from sim_twin.controller.motion import Breach, Cause
from sim_twin.controller.states import Event, SafetyMode
from tests.support.virtual_robot import make_robot, run, started

ERROR, SAFETY = 6, 5
WARNING, VIOLATION, FAULT = 2, 3, 4


def said(robot):
    """Take the safety modes and error codes that wait to be sent, in order."""
    found = []
    outbox = robot.machine.journal.outbox
    while outbox:
        message = outbox.popleft()
        kind, body = message[14], message[15:]
        if kind == SAFETY:
            code, argument, mode = struct.unpack(">iiBII", body)[:3]
            found.append((SAFETY, code, argument, SafetyMode(mode).name))
        elif kind == ERROR:
            code, argument, level = struct.unpack_from(">iii", body)
            found.append((ERROR, code, argument, level))
    return found


@pytest.mark.parametrize(
    ("event", "mode", "level"),
    [
        (Event.PROTECTIVE_STOP, "PROTECTIVE_STOP", WARNING),
        (Event.SAFEGUARD_OPENED, "SAFEGUARD_STOP", WARNING),
        (Event.ROBOT_ESTOP, "ROBOT_EMERGENCY_STOP", WARNING),
        (Event.SYSTEM_ESTOP, "SYSTEM_EMERGENCY_STOP", WARNING),
        (Event.VIOLATION, "VIOLATION", VIOLATION),
        (Event.FAULT, "FAULT", FAULT),
    ],
)
def test_a_stop_that_nobody_explains_is_an_error_without_a_code_and_a_change_of_mode(event, mode, level):
    robot = make_robot()
    robot.programs.handle(event)
    assert said(robot) == [(ERROR, 0, 0, level), (SAFETY, 0, 0, mode)]
    robot.programs.handle(event)
    run(robot, 5)
    assert said(robot) == []


def test_a_stop_is_told_with_the_code_of_what_brought_it():
    robot = make_robot()
    robot._stop_for(Breach(cause=Cause.JOINT_COLLISION, text="hit", joint=2))
    assert said(robot) == [(ERROR, 157, 2, WARNING), (SAFETY, 157, 2, "PROTECTIVE_STOP")]


def test_the_way_back_is_told_too_and_is_no_error():
    robot = make_robot()
    robot.programs.handle(Event.REDUCED)
    assert said(robot) == [(SAFETY, 0, 0, "REDUCED")]
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    said(robot)
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    robot.programs.handle(Event.REDUCED_ENDED)
    assert said(robot) == [(SAFETY, 0, 0, "REDUCED"), (SAFETY, 0, 0, "NORMAL")]


def test_a_program_that_stops_the_robot_is_told():
    robot = started("def f():\n sync()\n protective_stop()\n while True:\n  sync()\n end\nend\n")
    run(robot, 10)
    assert said(robot) == [(ERROR, 0, 0, WARNING), (SAFETY, 0, 0, "PROTECTIVE_STOP")]


def test_a_joint_that_stopped_the_robot_too_often_is_a_fault_of_its_own():
    robot = make_robot()
    for _ in range(50):
        robot.programs.handle(Event.PROTECTIVE_STOP, joint=3)
    said(robot)
    robot.programs.handle(Event.PROTECTIVE_STOP, joint=3)
    assert said(robot) == [(ERROR, 163, 3, VIOLATION), (SAFETY, 163, 3, "FAULT")]
