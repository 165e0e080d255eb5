"""Safety planes: the arm is stopped before it is beyond one, whatever its speed, and comes back from beyond one."""

import msgspec
import numpy as np
import pytest

from sim_twin.controller.faults import Faults
from sim_twin.controller.motion.limits import Plane
from sim_twin.controller.states import Event, PowerTimes, RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.wire import ControllerVersion, Outcome, Wires
from tests.support.virtual_robot import lines, make_robot, run, started, state_of

EDGE_M = 0.1
DOWN = "def f():\n p = get_actual_tcp_pose()\n p[2] = {z}\n movel(p, a={a}, v={v})\nend\n"
TIMES = PowerTimes(n_power_on=5, n_brake_release=5, n_before_unlock=100)
UP_RAD = [0.0, -0.3, 0.0, 0.0, 0.0, 0.0]
"""From home the shoulder lifts the tool so by some 0.15 m."""


def with_plane(robot, edge_m=EDGE_M):
    drive = robot.machine.drive
    drive.limits = msgspec.structs.replace(drive.limits, planes=(Plane(normal=(0.0, 0.0, 1.0), offset_m=edge_m),))
    return robot


def height_m(robot):
    return float(robot.machine.drive.measured.tcp_pose[2])


def faults_of(robot):
    wires = Wires(
        outputs=robot.outputs, inputs=robot.machine, dashboard=robot.panel, states=robot.panel, scripts=robot,
        gripper=robot.hand, version=ControllerVersion(), stamp_us=lambda: 0,
    )  # fmt: skip
    return Faults(robot, wires, TickTimes())


@pytest.mark.parametrize(
    "motion", [*(f"movel(p, a=20, v={v})" for v in (0.25, 0.5, 1.0, 2.0)), "speedl([0,0,-1,0,0,0], 20, 5)"]
)
def test_whatever_its_speed_the_tool_is_stopped_ahead_of_a_plane_and_keeps_its_power(motion):
    robot = with_plane(make_robot())
    robot.submit_script(f"def f():\n p = get_actual_tcp_pose()\n p[2] = p[2] - 0.15\n {motion}\nend\n")
    modes, lowest_m = robot.machine.modes, height_m(robot)
    for _ in range(500):
        robot.step()
        lowest_m = min(lowest_m, height_m(robot))
    assert (modes.safety, modes.robot) == (SafetyMode.PROTECTIVE_STOP, RobotMode.RUNNING), lines(robot)
    assert any(line.startswith("C152") for line in lines(robot))
    assert EDGE_M - 0.005 < lowest_m <= height_m(robot) < EDGE_M + 0.03


def test_a_move_that_ends_at_a_plane_is_no_stop():
    robot = with_plane(make_robot())
    robot.submit_script(DOWN.format(z=EDGE_M + 0.001, a=1.2, v=0.25))
    run(robot, 700)
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)
    assert height_m(robot) == pytest.approx(EDGE_M + 0.001, abs=1e-3)


def restarted(robot):
    panel, modes = robot.panel, robot.machine.modes
    modes.times = TIMES
    assert panel.restart_safety() is Outcome.DONE
    assert panel.power_on() is Outcome.DONE
    assert panel.brake_release() is Outcome.DONE
    run(robot, 3000, lambda: modes.robot is RobotMode.RUNNING)
    run(robot, 5)


def test_an_arm_that_violated_a_plane_is_brought_back_by_hand_after_a_restart():
    robot = started(DOWN.format(z=EDGE_M, a=1.2, v=0.25))
    run(robot, 150)
    with_plane(robot, height_m(robot) + 0.06)
    modes, faults = robot.machine.modes, faults_of(robot)
    run(robot, 200, lambda: modes.safety is SafetyMode.VIOLATION)
    assert modes.robot is RobotMode.POWER_OFF
    run(robot, 200)
    restarted(robot)
    assert (modes.safety, modes.robot) == (SafetyMode.RECOVERY, RobotMode.RUNNING), lines(robot)
    assert robot.outputs["safety_mode"]() == 4
    assert robot.outputs["safety_status_bits"]() == 1 << 3
    robot.submit_script("def f():\n set_digital_out(1, True)\nend\n")
    run(robot, 20)
    assert robot.machine.io.digital_out == 0
    assert any("recovery mode" in line for line in lines(robot))
    assert "refusal" not in faults.apply("jog", rad=UP_RAD)
    fastest_m_s = 0.0
    for _ in range(900):
        robot.step()
        fastest_m_s = max(fastest_m_s, float(np.linalg.norm(robot.machine.drive.measured.tcp_speed[:3])))
        assert modes.robot is RobotMode.RUNNING
    assert 0.05 < fastest_m_s < 0.25, "as slowly as a robot's recovery mode goes"
    assert (modes.safety, state_of(robot)) == (SafetyMode.NORMAL, RuntimeState.STOPPED)
    robot.submit_script("def f():\n set_digital_out(1, True)\nend\n")
    run(robot, 20)
    assert robot.machine.io.digital_out == 2


def test_an_arm_beyond_a_plane_is_led_no_further():
    robot = with_plane(make_robot(is_powered=False), 0.5)
    modes, faults = robot.machine.modes, faults_of(robot)
    modes.times = TIMES
    assert height_m(robot) < 0.46
    assert robot.panel.brake_release() is Outcome.DONE
    run(robot, 3000, lambda: modes.safety is SafetyMode.RECOVERY)
    before_m = height_m(robot)
    faults.apply("jog", rad=[-x for x in UP_RAD])
    run(robot, 300)
    assert (modes.safety, modes.robot) == (SafetyMode.PROTECTIVE_STOP, RobotMode.RUNNING)
    assert height_m(robot) > before_m - 0.01
    run(robot, 100)
    assert robot.programs.handle(Event.UNLOCK_PROTECTIVE_STOP).refusal is None
    assert modes.safety is SafetyMode.RECOVERY


def test_without_power_there_is_no_recovery_mode():
    robot = with_plane(make_robot(), 0.5)
    run(robot, 5)
    assert robot.machine.modes.safety is SafetyMode.RECOVERY
    robot.panel.power_off()
    run(robot, 5)
    assert robot.machine.modes.safety is SafetyMode.NORMAL
