"""The state ports tell what RTDE tells, and of the arm's own kinematics what it is."""

import numpy as np
import pytest

from sim_twin.controller.faults import Faults
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.realtime import RealtimeState
from tests.support.virtual_robot import make_robot, run, started

BY_FIELD = {
    "time_s": "timestamp",
    "q_target_rad": "target_q",
    "qd_target_rad_s": "target_qd",
    "qdd_target_rad_s2": "target_qdd",
    "current_target_a": "target_current",
    "moment_target_nm": "target_moment",
    "q_rad": "actual_q",
    "qd_rad_s": "actual_qd",
    "current_a": "actual_current",
    "control_current_a": "joint_control_output",
    "tcp_pose": "actual_TCP_pose",
    "tcp_speed": "actual_TCP_speed",
    "tcp_force_n": "actual_TCP_force",
    "tcp_pose_target": "target_TCP_pose",
    "tcp_speed_target": "target_TCP_speed",
    "digital_inputs": "actual_digital_input_bits",
    "motor_temperature_c": "joint_temperatures",
    "controller_timer_ms": "actual_execution_time",
    "robot_mode": "robot_mode",
    "joint_modes": "joint_mode",
    "safety_mode": "safety_mode",
    "tool_acceleration_m_s2": "actual_tool_accelerometer",
    "speed_scaling": "speed_scaling",
    "momentum_norm": "actual_momentum",
    "main_voltage_v": "actual_main_voltage",
    "robot_voltage_v": "actual_robot_voltage",
    "robot_current_a": "actual_robot_current",
    "joint_voltage_v": "actual_joint_voltage",
    "digital_outputs": "actual_digital_output_bits",
    "program_state": "runtime_state",
    "elbow_position_m": "elbow_position",
    "elbow_velocity_m_s": "elbow_velocity",
    "safety_status": "safety_status",
    "payload_kg": "payload",
    "payload_cog_m": "payload_cog",
    "payload_inertia_kg_m2": "payload_inertia",
}


@pytest.fixture
def moving():
    """An arm under way, with a load, an output and an input of its tool set."""
    robot = started("def f():\n set_digital_out(3, True)\n speedj([0.3, -0.2, 0.2, 0.1, 0.1, 0.1], 5, 9)\nend\n")
    robot.machine.execution_s = 7e-4
    robot.machine.io.tool_analog_in = [1.5, 2.5]
    run(robot, 100)
    yield robot
    robot.close()


def test_every_number_of_the_realtime_packet_is_the_one_that_rtde_sends(moving):
    assert BY_FIELD.keys() == set(RealtimeState.__struct_fields__)
    state = moving.panel.realtime_state()
    for field, name in BY_FIELD.items():
        assert np.asarray(getattr(state, field)) == pytest.approx(np.asarray(moving.outputs[name]())), field
    assert np.abs(state.elbow_velocity_m_s).max() > 0.05
    assert state.robot_current_a > 0.1


def test_the_momentum_is_that_of_every_moving_body_of_the_arm(moving):
    model, data = moving.machine.world.model, moving.machine.world.data
    arm = [k for k in range(model.nbody) if model.body_rootid[k] == model.body("link_0").id]
    before = data.xipos[arm].copy()
    run(moving)
    moved = model.body_mass[arm] @ (data.xipos[arm] - before) / 0.002
    told = moving.outputs["actual_momentum"]()
    assert told == pytest.approx(np.linalg.norm(moved), rel=0.01)
    assert told > 0.5


def test_the_primary_state_has_the_currents_and_inputs_that_rtde_sends(moving):
    state, told = moving.panel.primary_state(), moving.outputs
    assert state.masterboard.robot_current_a == told["actual_robot_current"]()
    assert state.masterboard.io_current_a == told["io_current"]()
    assert state.tool.analog_inputs == (told["tool_analog_input0"](), told["tool_analog_input1"]()) == (1.5, 2.5)
    assert list(state.joints.current_a) == told["actual_current"]()


def test_the_control_mode_tells_of_force_and_freedrive():
    def mode(text):
        robot = started(f"def f():\n {text}\n while True:\n  sync()\n end\nend\n")
        run(robot, 5)
        return robot.panel.primary_state().mode.control_mode

    assert mode("sync()") == 0
    assert mode("freedrive_mode()") == 1
    torque = started(
        "def f():\n while True:\n  direct_torque([0,0,0,0,0,0])\n end\nend\n", version=ControllerVersion(minor=23)
    )
    run(torque, 5)
    assert torque.panel.primary_state().mode.control_mode == 3
    torque.panel.stop()
    run(torque, 20)
    assert torque.panel.primary_state().mode.control_mode == 0
    assert mode("force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,1,0,0,0], 2, [1,1,1,1,1,1])") == 2


def test_a_calibrated_arm_has_another_checksum_in_every_row_and_says_so():
    def calibrated(seed):
        robot = make_robot()
        Faults(robot, None, TickTimes(), seed=seed).calibrate(mm=0.5, mrad=0.5)
        return robot

    before, again = (make_robot().panel.primary_state().kinematics for _ in range(2))
    after, other = (calibrated(seed).panel.primary_state().kinematics for seed in (1, 2))
    assert before == again
    assert (before.calibration_status, after.calibration_status) == (0, 2)
    rows = [kinematics.checksum for kinematics in (before, after, other)]
    assert all(len(set(numbers)) == 3 for numbers in zip(*rows, strict=True))


def test_the_elbow_is_that_of_the_calibrated_arm():
    robot = make_robot()
    run(robot, 2)
    before = robot.outputs["elbow_position"]()
    Faults(robot, None, TickTimes(), seed=1).calibrate(mm=5.0, mrad=0.5)
    assert robot.outputs["elbow_position"]() == robot.panel.realtime_state().elbow_position_m != before
