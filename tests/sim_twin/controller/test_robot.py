"""The virtual robot without ports, slice by slice: power, stops, torques, and what it tells of itself."""

import math

import msgspec
import numpy as np
import pytest

from sim_twin.controller.faults import Faults
from sim_twin.controller.motion.limits import Plane
from sim_twin.controller.states import Event, RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.wire import ControllerVersion, Outcome, output_fields
from tests.support.virtual_robot import FOREVER, ended, lines, make_robot, run, started, state_of

NEWEST = ControllerVersion(minor=26)
STOPPED, PLAYING, PAUSED = RuntimeState.STOPPED, RuntimeState.PLAYING, RuntimeState.PAUSED


def test_power_comes_up_through_the_dashboard():
    robot = make_robot(is_powered=False)
    robot.submit_script(FOREVER)
    run(robot, 3)
    assert state_of(robot) is STOPPED
    assert any("was not started" in line for line in lines(robot))
    assert robot.panel.brake_release() is Outcome.DONE
    run(robot, 2000, lambda: robot.machine.modes.robot is RobotMode.RUNNING)
    assert robot.outputs["joint_mode"]() == (253,) * 6


def test_power_and_brakes_asked_for_again_change_nothing():
    robot = started(FOREVER)
    robot.panel.power_on()
    robot.panel.brake_release()
    robot.panel.unlock_protective_stop()
    run(robot, 10)
    assert (state_of(robot), robot.machine.modes.robot) == (PLAYING, RobotMode.RUNNING)
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def test_an_emergency_stop_takes_the_power_and_is_recovered_from_by_hand():
    robot = started("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 1\n movej(q)\nend\n")
    run(robot, 300)
    robot.programs.handle(Event.ROBOT_ESTOP)
    assert robot.outputs["safety_status_bits"]() >> 7 & 1
    run(robot, 400)
    assert (state_of(robot), robot.machine.modes.robot) == (STOPPED, RobotMode.POWER_OFF)
    assert robot.panel.brake_release() is Outcome.FAILED
    robot.programs.handle(Event.ROBOT_ESTOP_RELEASED)
    assert robot.panel.brake_release() is Outcome.DONE
    run(robot, 2000, lambda: robot.machine.modes.robot is RobotMode.RUNNING)
    robot.submit_script(FOREVER)
    run(robot, 3)
    assert state_of(robot) is PLAYING


def test_torques_move_a_joint_and_then_it_is_held():
    robot = started(
        "def f():\n i = 0\n while i < 100:\n  direct_torque([0, 0, 0, 0, 0, 0])\n  i = i + 1\n end\n"
        " while i < 150:\n  direct_torque([8, 0, 0, 0, 0, 0])\n  i = i + 1\n end\nend\n",
        version=ControllerVersion(minor=23),
    )
    q = robot.machine.world.data.qpos
    start = q[:6].copy()
    run(robot, 90)
    assert q[:6] == pytest.approx(start, abs=1e-3), "its weight is carried"
    ended(robot)
    run(robot, 300)
    held = q[:6].copy()
    assert 0.01 < held[0] - start[0] < 0.3
    run(robot, 100)
    assert q[:6] == pytest.approx(held, abs=1e-4)
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def test_a_collision_pauses_the_program_and_names_its_code():
    robot = started("def f():\n speedl([0, 0, -0.03, 0, 0, 0], 1, 20)\nend\n")
    run(robot, 9000, lambda: robot.machine.modes.is_stopped_by_safety)
    assert robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP
    run(robot, 300)
    assert state_of(robot) is PAUSED
    assert sum(line.startswith("C15") for line in lines(robot)) == 1, "one blow, one stop"


def test_every_output_has_a_getter_and_fits_its_type():
    robot = make_robot()
    robot.step()
    for version in (ControllerVersion(major=3, minor=15), ControllerVersion(), ControllerVersion(minor=26)):
        for name, kind in output_fields(version).items():
            value = robot.outputs[name]()
            assert (len(value) if kind.n_items > 1 else 1) == kind.n_items, name
    assert robot.outputs["timestamp"]() == pytest.approx(0.002)
    assert math.dist(robot.outputs["elbow_position"](), (0, 0, 0.1625)) == pytest.approx(0.425, abs=1e-6)


def test_noise_is_seen_by_interfaces_and_not_by_physics():
    robot = make_robot()
    bias = np.array([0.01, 0, 0, 0, 0, 0])
    robot.disturb = lambda m: msgspec.structs.replace(m, q_rad=m.q_rad + bias)
    run(robot, 5)
    off = np.array(robot.outputs["actual_q"]()) - robot.machine.world.data.qpos[:6]
    assert off == pytest.approx(bias)
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def test_the_speeds_that_are_read_are_as_noisy_as_the_angles():
    robot = make_robot()
    fault = Faults(robot, None, TickTimes()).apply
    run(robot, 5)
    fault("noise", rad=1e-3)
    seen = []
    for _ in range(1500):
        robot.step()
        seen.append((robot.outputs["actual_qd"](), robot.outputs["actual_TCP_speed"](), robot.outputs["actual_q"]()))
    qd, tcp, q = (np.array(column) for column in zip(*seen, strict=True))
    measured = robot.machine.drive.measured
    J = robot.machine.drive.kinematics.jacobian(measured.q_rad, robot.machine.drive.core.T_ft)
    assert tcp[-1] == pytest.approx(J @ qd[-1], abs=1e-9), "one and the same noise"
    assert (qd[500:].std(axis=0) > 2e-3).all()
    assert (qd[500:].std(axis=0) < 8e-3).all()
    # What is read is moved by the noise alone: speeds, summed up, come back to where they began.
    assert np.abs(np.cumsum(qd, axis=0) * 0.002).max() < 5e-3
    assert q.std(axis=0) == pytest.approx(np.full(6, 1e-3), rel=0.15)
    assert robot.machine.drive.is_standing, "and the arm stands"
    fault("noise")
    run(robot, 2)
    assert np.abs(robot.outputs["actual_qd"]()).max() < 1e-4


def test_the_tools_accelerometer_feels_how_the_tool_moves():
    robot = make_robot()
    run(robot, 5)
    kinematics = robot.machine.drive.kinematics
    assert np.linalg.norm(robot.outputs["actual_tool_accelerometer"]()) == pytest.approx(9.81, abs=0.01)
    robot.submit_script("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] - 1.5\n movej(q, a=6, v=3)\nend\n")
    greatest, seen = 0.0, []
    for _ in range(150):
        robot.step()
        q = robot.machine.world.data.qpos[:6].copy()
        T_bf = kinematics.forward(q)
        seen.append(T_bf[:3, 3])
        felt = T_bf[:3, :3] @ robot.outputs["actual_tool_accelerometer"]() - [0.0, 0.0, 9.81]
        if len(seen) >= 3:
            expected = (seen[-1] - 2.0 * seen[-2] + seen[-3]) / 0.002**2
            assert felt == pytest.approx(expected, abs=0.35)
            greatest = max(greatest, float(np.linalg.norm(felt)))
    assert greatest > 2.0
    assert robot.panel.realtime_state().tool_acceleration_m_s2 == robot.outputs["actual_tool_accelerometer"]()


def test_the_deviation_ratio_tells_how_near_a_stop_is_and_every_e_series_has_it():
    robot = make_robot()
    run(robot, 50)
    ratio = robot.outputs["joint_position_deviation_ratio"]
    assert ratio() < 0.01
    robot.machine.world.data.qfrc_applied[0] = 60.0
    run(robot, 100)
    assert 0.02 < ratio() < 1.0
    assert "joint_position_deviation_ratio" in output_fields(ControllerVersion())
    assert "control_step" not in output_fields(ControllerVersion(minor=25))


PRESS = """def f():
 p = get_target_tcp_pose()
 p[2] = p[2] - 0.2
 movel(p, a=2, v=0.3)
 q0 = get_actual_joint_positions()
 w = 0
 while True:
  q = get_actual_joint_positions()
  d = get_actual_joint_speeds()
  w = w + 0.4
  direct_torque([400*(q0[0]-q[0])-30*d[0], w-30*d[1], 800*(q0[2]-q[2])-30*d[2], 200*(q0[3]-q[3])-5*d[3],
   200*(q0[4]-q[4])-5*d[4], 200*(q0[5]-q[5])-5*d[5]])
 end
end
"""


TURN = (
    "def f():\n while True:\n  d = get_actual_joint_speeds()\n  direct_torque([20*({v}-d[0]),0,0,0,0,0])\n end\nend\n"
)


def test_torques_that_press_on_the_table_too_hard_are_a_protective_stop():
    robot = started(PRESS, version=NEWEST)
    seen = []

    def is_stopped():
        seen.append(float(np.linalg.norm(robot.machine.drive.measured.wrench[:3])))
        return robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP

    run(robot, 2000, is_stopped)
    limit = robot.machine.drive.limits.tool_force_n
    assert max(seen) < limit + 25
    assert any("C158" in line for line in lines(robot))
    run(robot, 500)
    assert float(np.linalg.norm(robot.machine.drive.measured.wrench[:3])) < limit
    assert robot.machine.modes.robot is RobotMode.RUNNING, "stopped before its drives were cut"


def test_torques_lead_no_joint_beyond_its_limit():
    robot = started(TURN.format(v=0.8), version=NEWEST)
    drive = robot.machine.drive
    most = drive.measured.q_rad[0] + 0.3
    drive.limits = msgspec.structs.replace(drive.limits, q_max_rad=(most, *drive.limits.q_max_rad[1:]))
    run(robot, 2000, lambda: robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP)
    run(robot, 300)
    assert any("C150" in line for line in lines(robot))
    assert most < drive.measured.q_rad[0] < most + np.radians(5)
    assert robot.machine.modes.robot is RobotMode.RUNNING


def test_torques_lead_the_tool_beyond_no_plane():
    robot = started(TURN.format(v=0.5), version=NEWEST)
    drive = robot.machine.drive
    edge = drive.measured.tcp_pose[1] + 0.05
    drive.limits = msgspec.structs.replace(drive.limits, planes=(Plane(normal=(0.0, -1.0, 0.0), offset_m=-edge),))
    run(robot, 2000, lambda: robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP)
    run(robot, 300)
    assert any("C152" in line for line in lines(robot))
    assert drive.measured.tcp_pose[1] < edge + 0.04
    assert robot.machine.modes.robot is RobotMode.RUNNING


@pytest.mark.parametrize(
    ("main", "thread"),
    [("movej(q)", "direct_torque([2,0,0,0,0,0])"), ("while True:\n  direct_torque([2,0,0,0,0,0])\n end", "movej(q)")],
)
def test_a_move_beside_torques_is_a_conflict(main, thread):
    text = (
        "def f():\n q = get_actual_joint_positions()\n q[5] = q[5] + 0.5\n thread t():\n  while True:\n"
        f"   {thread}\n  end\n end\n sync()\n h = run t()\n {main}\nend\n"
    )
    robot = started(text, version=NEWEST)
    run(robot, 20)
    assert state_of(robot) is RuntimeState.STOPPED
    assert any("another thread" in line for line in lines(robot))


def test_an_arm_that_presses_on_while_it_is_stopped_moves_again_once_it_is_released():
    robot = started(FOREVER)
    robot.programs.handle(Event.PROTECTIVE_STOP)
    drive = robot.machine.drive
    limits = drive.limits
    drive.limits = msgspec.structs.replace(limits, tool_force_n=-100.0)  # whatever the tool feels is beyond it
    run(robot, 20)
    assert robot.machine.modes.safety is SafetyMode.PROTECTIVE_STOP
    drive.limits = limits
    run(robot, 2600)
    assert robot.panel.unlock_protective_stop() is Outcome.DONE
    robot.panel.stop()
    run(robot, 20)
    before = drive.measured.q_rad[0]
    robot.submit_script("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 0.2\n movej(q)\nend\n")
    run(robot, 800)
    assert drive.measured.q_rad[0] == pytest.approx(before + 0.2, abs=1e-3)
