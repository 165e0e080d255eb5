"""What UR's script manual (e-Series) says of functions that tell of a robot or act on it."""

import msgspec
import numpy as np
import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.pose import Pose
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.states import RobotMode, SafetyMode
from sim_twin.controller.wire import ControllerVersion
from tests.support.virtual_robot import ended, lines, make_robot, run


def told(body, robot=None):
    """Run a program to its end and return what it wrote to registers, and the robot."""
    robot = robot or make_robot(version=ControllerVersion(minor=26))
    robot.submit_script(f"def f():\n{body}\nend\n")
    run(robot, 3)
    ended(robot, 4000)
    return robot.machine.registers.outputs, robot


def answered(expression):
    """Return the log after a program that asks for an expression."""
    return " ".join(lines(told(f" x = {expression}\n")[1]))


def test_a_payload_told_wrong_zeroes_the_force_and_stops_nothing():
    _, robot = told(" set_payload(30)\n sleep(0.1)\n write_output_float_register(0, force())\n set_payload_mass(50)\n")
    run(robot, 200)
    assert robot.machine.registers.outputs.double_at(0) == pytest.approx(0.0, abs=1e-6)
    assert robot.machine.modes.safety is SafetyMode.NORMAL
    assert robot.machine.modes.robot is RobotMode.RUNNING
    outputs, _ = told(" set_payload_cog([0, 0, 0.1])\n write_output_float_register(1, 1.5)\n", robot)
    assert outputs.double_at(1) == 1.5


@pytest.mark.parametrize(
    ("inertia", "is_fine"),
    [
        ("[133, 0, 0, -133, 0, 133]", True),
        ("[133.01, 0, 0, 0, 0, 0]", False),
        ("[0, 0, 0, 0, -133.01, 0]", False),
        ("[0, -0.001, 0, 0, 0, 0]", False),
        ("[0, 0, -1, 0, 0, 0]", False),
    ],
)
def test_an_inertia_beyond_the_limits_ends_the_program_and_tells_nothing(inertia, is_fine):
    _, robot = told(f" set_target_payload(1.5, [0, 0, 0.05], {inertia})\n")
    assert ("expected an inertia within 133" not in " ".join(lines(robot))) is is_fine
    assert (robot.machine.drive.payload[0] == 1.5) is is_fine


def test_setting_a_payload_without_an_inertia_resets_it():
    _, robot = told(" set_target_payload(1, [0, 0, 0], [1, 1, 1, 0, 0, 0])\n set_payload(1, [0, 0, 0])\n")
    assert robot.machine.payload_inertia == [0.0] * 6


def test_the_waypoint_is_the_moves_while_it_runs_or_blends_and_the_tools_otherwise():
    body = """
 def far(a, b):
  return point_dist(a, b)
 end
 start = get_target_tcp_pose()
 up = pose_add(start, p[0, 0, 0.1, 0, 0, 0])
 higher = pose_add(start, p[0, 0, 0.15, 0, 0, 0])
 thread watch():
  sleep(0.2)
  write_output_float_register(0, far(get_target_waypoint(), up))
 end
 w = run watch()
 movel(up, a=1, v=0.2, r=0.03)
 write_output_float_register(1, far(get_target_waypoint(), up))
 write_output_float_register(2, far(get_target_tcp_pose(), up))
 movel(higher, a=1, v=0.2)
 write_output_float_register(3, far(get_target_waypoint(), get_target_tcp_pose()))
 speedl([0, 0, -0.05, 0, 0, 0], 1, 0.5)
 write_output_float_register(4, far(get_target_waypoint(), higher))
 write_output_float_register(5, far(get_target_waypoint(), get_target_tcp_pose()))
 stopl(2)
"""
    outputs, _ = told(body)
    in_move, in_blend, behind, after, off, on = (outputs.double_at(i) for i in range(6))
    assert max(in_move, in_blend, after, on) < 1e-9
    assert behind > 0.02
    assert off > 0.005


def test_an_arm_is_steady_after_half_a_second_of_standing():
    body = """
 speedj([0.2, 0, 0, 0, 0, 0], 2, 0.2)
 stopj(4)
 i = 0
 while not is_steady():
  i = i + 1
  sync()
 end
 write_output_integer_register(0, i)
"""
    outputs, _ = told(body)
    assert 245 <= outputs.int_at(0) < 320


def test_powering_down_cuts_the_power_and_switches_the_controller_off():
    _, robot = told(" powerdown()\n sleep(1)\n write_output_integer_register(0, 7)\n")
    assert robot.machine.is_shut_down
    assert robot.machine.modes.robot is RobotMode.POWER_OFF
    assert robot.machine.registers.outputs.int_at(0) == 0


def test_history_reaches_as_far_as_its_buffer():
    assert "expected 0 to 999 time steps, got 1000" in answered("get_actual_joint_positions_history(1000)")
    assert "expected" not in answered("get_actual_joint_positions_history(999)")


@pytest.mark.parametrize("name", ["get_actual_tcp_speed", "get_target_tcp_speed", "get_tcp_force"])
def test_what_is_told_in_a_pose_is_one(name):
    robot = make_robot()
    functions = program_builtins(robot.machine, Sockets(slice_s=0.002))
    assert type(functions[name]()) is Pose


def test_limits_are_asked_of_the_solution_near_the_joints_that_are_given():
    robot = make_robot()
    drive = robot.machine.drive
    functions = program_builtins(robot.machine, Sockets(slice_s=0.002))
    is_within, aim = functions["is_within_safety_limits"], functions["get_actual_tcp_pose"]()
    q = drive.measured.q_rad
    flipped = functions["get_inverse_kin"](aim, (q + np.array([0, 0, 0, np.pi, -2 * q[4], np.pi])).tolist())
    assert np.abs(np.array(flipped) - q).max() > 1.0
    drive.limits = msgspec.structs.replace(drive.limits, q_min_rad=q - 0.5, q_max_rad=q + 0.5)
    assert is_within(position=aim) is True
    assert is_within(aim, qNear=flipped) is False


def test_whether_a_pose_can_be_reached_is_asked_by_the_manuals_name():
    functions = program_builtins(make_robot().machine, Sockets(slice_s=0.002))
    assert functions["get_inverse_kin_has_solution"](pose=Pose(3, 0, 0, 0, 0, 0)) is False
