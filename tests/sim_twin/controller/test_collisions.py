"""A collision is a protective stop, however hard the blow; only what goes on pressing afterwards cuts the drives."""

import numpy as np
import pytest

from sim_twin.controller.motion.limits import PRESSED_S
from sim_twin.controller.motion.setpoint import SLICE_S
from sim_twin.controller.states import Event, PowerTimes, RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.wire import Outcome
from tests.support.virtual_robot import FOREVER, lines, make_robot, run, started, state_of, swept_rad

DOWN = "def f():\n p = get_actual_tcp_pose()\n p[2] = p[2] - 0.3\n movel(p, a=3, v={v})\nend\n"
N_TO_REST = 500


def force_n(robot):
    return float(np.linalg.norm(robot.machine.drive.measured.wrench[:3]))


def hit(robot):
    """Step until a stop comes and for as long as it may take to rest; return what the log says of it."""
    run(robot, 3000, lambda: robot.machine.modes.is_stopped_by_safety)
    run(robot, N_TO_REST)
    return [line for line in lines(robot) if line.startswith("C") and ":" in line.split()[0]]


def assert_stopped_once(robot, told):
    modes = robot.machine.modes
    assert (modes.safety, modes.robot) == (SafetyMode.PROTECTIVE_STOP, RobotMode.RUNNING), told
    assert len(told) == 1, told
    assert told[0].startswith(("C157", "C158")), told
    assert state_of(robot) is RuntimeState.PAUSED
    assert not robot.machine.drive.is_braked
    assert force_n(robot) < robot.machine.drive.limits.tool_force_n, "it gave way"
    assert swept_rad(robot, 100) < 2e-3


@pytest.mark.parametrize("v", [0.25, 0.5, 1.0])
def test_a_tool_that_strikes_the_table_is_stopped_and_keeps_its_power(v):
    robot = started(DOWN.format(v=v))
    assert_stopped_once(robot, hit(robot))


@pytest.mark.parametrize("v", [0.5, 1.0, 2.0])
def test_a_sweep_of_the_joints_into_the_table_is_stopped_and_keeps_its_power(v):
    robot = started(f"def f():\n q = get_actual_joint_positions()\n q[1] = q[1] + 0.9\n movej(q, a=6, v={v})\nend\n")
    assert_stopped_once(robot, hit(robot))


def test_after_a_hard_collision_the_arm_is_unlocked_and_moves_away():
    robot = started(DOWN.format(v=1.0))
    robot.machine.modes.times = PowerTimes(n_before_unlock=100)
    hit(robot)
    assert robot.panel.unlock_protective_stop() is Outcome.DONE
    robot.panel.stop()
    run(robot, 20)
    robot.submit_script("def f():\n p = get_actual_tcp_pose()\n p[2] = p[2] + 0.1\n movel(p, a=1, v=0.2)\nend\n")
    before = robot.machine.drive.measured.tcp_pose[2]
    run(robot, 500)
    assert robot.machine.drive.measured.tcp_pose[2] - before == pytest.approx(0.1, abs=5e-3)
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def test_what_goes_on_pressing_after_the_stop_cuts_the_drives():
    robot = started(FOREVER)
    modes, drive = robot.machine.modes, robot.machine.drive
    feel = drive._read

    def pressed():
        measured = feel()
        measured.wrench[2] = 300.0
        return measured

    drive._read = pressed
    run(robot, 200, lambda: modes.safety is SafetyMode.PROTECTIVE_STOP)
    n_slices = run(robot, 500, lambda: modes.safety is SafetyMode.VIOLATION)
    assert n_slices * SLICE_S == pytest.approx(PRESSED_S, abs=0.03)
    assert (modes.robot, drive.is_braked) == (RobotMode.POWER_OFF, True)


def test_a_push_that_ends_after_the_stop_cuts_nothing():
    robot = make_robot()
    robot.programs.handle(Event.PROTECTIVE_STOP)
    drive = robot.machine.drive
    feel, n_slices = drive._read, [0]

    def pushed_now_and_then():
        measured = feel()
        n_slices[0] += 1
        if n_slices[0] % 200 < 100:
            measured.wrench[2] = 300.0
        return measured

    drive._read = pushed_now_and_then
    run(robot, 1000)
    assert (robot.machine.modes.safety, drive.is_braked) == (SafetyMode.PROTECTIVE_STOP, False)
