"""Speeds and accelerations beyond the arm's are held to its limits and reached; jumps of servoj stay stops."""

import numpy as np
import pytest

from sim_twin.controller.motion.limits import JOINT_SPEED_TOLERANCE_RAD_S
from sim_twin.controller.states import RuntimeState, SafetyMode
from tests.support.virtual_robot import lines, run, started, state_of

LIMIT_RAD_S = np.pi
HERE = "def f():\n q = get_actual_joint_positions()\n p = get_actual_tcp_pose()\n"


def told(robot, n=1500):
    """Step until the program has ended; return the set-point's and the joints' greatest speeds and way."""
    data, setpoint = robot.machine.world.data, robot.machine.drive.motions.setpoint
    start, asked, felt = data.qpos[:6].copy(), np.zeros(6), np.zeros(6)
    for _ in range(n):
        robot.step()
        asked, felt = np.maximum(asked, np.abs(setpoint.qd_target)), np.maximum(felt, np.abs(data.qvel[:6]))
        if state_of(robot) is not RuntimeState.PLAYING:
            break
    run(robot, 60)
    return asked, felt, data.qpos[:6] - start


@pytest.mark.parametrize("call", ["a=20, v=6", "a=200, v=100", "t=0.05", "a=0.5, v=9, t=0.3"])
def test_a_joint_move_asked_for_too_fast_goes_as_fast_as_the_arm_may(call):
    robot = started(f"{HERE} q[0] = q[0] - 2\n q[5] = q[5] + 1\n movej(q, {call})\n stopj(5)\nend\n")
    asked, felt, way = told(robot)
    assert asked[0] == pytest.approx(LIMIT_RAD_S, rel=1e-6)
    assert felt.max() < LIMIT_RAD_S + JOINT_SPEED_TOLERANCE_RAD_S
    assert way[[0, 5]] == pytest.approx([-2.0, 1.0], abs=2e-3)
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)


def test_a_joint_move_accelerates_no_harder_than_the_arm_may():
    robot = started(f"{HERE} q[0] = q[0] - 1\n movej(q, a=1000, v=2)\nend\n")
    setpoint, hardest = robot.machine.drive.motions.setpoint, 0.0
    for _ in range(300):
        robot.step()
        hardest = max(hardest, float(np.abs(setpoint.qdd_target).max()))
    assert hardest == pytest.approx(25.0, rel=0.01)


def test_a_tool_move_asked_for_too_fast_reaches_its_end_without_a_stop():
    robot = started(f"{HERE} movel(pose_trans(p, p[0,0.3,-0.2,0,0,1.5]), a=150, v=20)\n stopl(5)\nend\n")
    before = robot.machine.drive.measured.tcp_pose[:3]
    asked, _, _ = told(robot)
    assert asked.max() <= LIMIT_RAD_S * (1 + 1e-9)
    run(robot, 100)
    after = robot.machine.drive.measured.tcp_pose[:3]
    assert np.linalg.norm(after - before) == pytest.approx(np.hypot(0.3, 0.2), abs=2e-3)
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)


def test_joint_speeds_asked_for_too_great_are_brought_down_in_proportion():
    robot = started("def f():\n speedj([-9,0,0,0,0,4.5], 100, 0.5)\n stopj(10)\nend\n")
    asked, felt, _ = told(robot)
    assert asked[[0, 5]] == pytest.approx([LIMIT_RAD_S, LIMIT_RAD_S / 2], rel=1e-6)
    assert felt.max() < LIMIT_RAD_S + JOINT_SPEED_TOLERANCE_RAD_S
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)


@pytest.mark.parametrize("value", ["0", "-1", "1e308*10"])
@pytest.mark.parametrize("name", ["a", "v"])
def test_a_speed_that_is_none_is_still_an_error(name, value):
    robot = started(f"{HERE} sync()\n q[0] = q[0] - 1\n movej(q, {name}={value})\nend\n")
    run(robot, 20)
    assert state_of(robot) is RuntimeState.STOPPED
    assert any("above 0" in line for line in lines(robot))


def test_targets_of_servoj_too_far_apart_are_still_a_protective_stop():
    robot = started(f"{HERE} sync()\n q[0] = q[0] - 1.5\n servoj(q, t=0.5)\nend\n")
    run(robot, 20)
    assert robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP
