"""A program of ours that uses what UR's external-control script uses, and the peer on its socket that judges each word.

The virtual robot's physics run slice by slice in this process; nothing here waits on the clock.
"""

import ast
import socket
import struct
from contextlib import suppress

import numpy as np
import pytest

from sim_twin.controller.wire.version import ControllerVersion
from tests.support.virtual_robot import ended, lines, make_robot, run

PROGRAM = """\
def external():
  socket_open("127.0.0.1", {port}, "peer")
  def tell(name, value):
    socket_send_line(str_cat(str_cat(name, " "), to_str(value)), "peer")
  end
  def rest():
    stopj(4.0)
    while not is_steady():
      sync()
    end
  end

  numbers = socket_read_binary_integer(2, "peer", 2.0)
  tell("echo", numbers[1] + numbers[2])
  tell("steptime", get_steptime())
  home = get_joint_positions()
  tell("joint_positions", home)
  tell("actual_joint_positions", get_actual_joint_positions())
  tell("target_joint_positions", get_target_joint_positions())
  start = get_actual_tcp_pose()

  speedj([0.2, 0, 0, 0, 0, 0], 2.0, 0.6)
  tell("history_now", get_actual_joint_positions_history(0))
  tell("history_50", get_actual_joint_positions_history(50))
  tell("target_joint_speeds", get_target_joint_speeds())
  tell("actual_joint_speeds", get_actual_joint_speeds())
  tell("tcp_speed_turning", get_actual_tcp_speed())
  rest()
  movej(home, a=4.0, v=1.0)
  tell("movej", get_target_joint_positions())

  speedl([0, 0, 0.05, 0, 0, 0], 0.5, 0.5)
  tell("tcp_speed_rising", get_actual_tcp_speed())
  tell("target_tcp_speed", get_target_tcp_speed())
  stopl(1.0)
  rest()
  movel(start, a=1.0, v=0.2)
  tell("movel", get_actual_tcp_pose())
  movep(pose_trans(start, p[0, 0, -0.05, 0, 0, 0]), a=1.0, v=0.2)
  tell("movep", get_actual_tcp_pose())
  movec(pose_add(start, p[0.02, 0, 0.02, 0, 0, 0]), start, a=1.0, v=0.1)
  tell("movec", get_actual_tcp_pose())

  aim = get_target_joint_positions()
  i = 0
  while i < 300:
    i = i + 1
    aim[5] = home[5] + 0.1 * i / 300
    servoj(aim, t=0.002, lookahead_time=0.03, gain=2000)
  end
  i = 0
  while i < 200:
    i = i + 1
    servoj(aim, t=0.002, lookahead_time=0.03, gain=2000)
  end
  tell("servoj", get_actual_joint_positions())
  rest()

  set_payload(0.0, [0, 0, 0])
  sleep(0.2)
  zero_ftsensor()
  sleep(0.2)
  tell("force_zeroed", get_tcp_force())
  set_payload(1.0, [0, 0, 0.05])
  sleep(0.2)
  tell("force_payload_1kg", get_tcp_force())
  zero_ftsensor()
  sleep(0.2)
  tell("force_zeroed_again", get_tcp_force())
  set_target_payload(1.5, [0.0, 0.0, 0.06], [0.01, 0.01, 0.01, 0, 0, 0])
  tell("target_payload", get_target_payload())
  tell("target_payload_cog", get_target_payload_cog())
  set_payload(0.0, [0, 0, 0])
  zero_ftsensor()
  sleep(0.2)

  force_mode_set_damping(0.05)
  force_mode_set_gain_scaling(1.0)
  tell("before_force", get_actual_tcp_pose())
  force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 40, 0, 0, 0], 2, [0.05, 0.05, 0.05, 0.2, 0.2, 0.2])
  sleep(0.8)
  tell("after_force", get_actual_tcp_pose())
  end_force_mode()
  rest()

  tell("contact_in_the_air", tool_contact([0, 0, -1, 0, 0, 0]))
  freedrive_mode([1, 1, 1, 1, 1, 1])
  sleep(0.1)
  tell("freedrive_status", get_freedrive_status())
  end_freedrive_mode()
  rest()

  ft_rtde_input_enable(True, 0.3)
  ft_rtde_input_enable(False)
  set_tool_voltage(24)
  set_gravity([0, 0, 9.81])
  tell("gravity", get_gravity())
  set_tcp(p[0, 0, 0.16, 0, 0, 0])
  tell("tcp_offset", get_tcp_offset())
  set_standard_digital_out(3, True)
  tell("digital_out", get_standard_digital_out(3))
  tell("norm", norm([3, 4]))
  tell("pow", pow(2, 10))
  tell("inverse", get_inverse_kin(get_forward_kin(home), qnear=home))
  sync()
  tell("reachable", get_inverse_kin_has_solution(start))
  sync()
  tell("out_of_reach", get_inverse_kin_has_solution(p[3, 0, 0, 0, 0, 0]))
  sync()
  tell("within_limits", is_within_safety_limits(start))
  sync()
  tell("beyond_limits", is_within_safety_limits([0, 0, 7, 0, 0, 0]))
  tell(
    "list_sum",
    [1, 2, 3] + 2 * [10, 20, 30]
  )
  popup("a word", title="external", warning=False, error=False, blocking=False)
  textmsg("all told")
{more}
  socket_send_int(-2, "peer")
  socket_close("peer")
  halt
  textmsg("after halt")
end
"""
TORQUES = """\
  i = 0
  while i < 50:
    i = i + 1
    direct_torque([0, 0, 0, 0, 0, 0])
  end
  rest()
  tell("mass_matrix", get_mass_matrix())
  optimovej(home, a=0.5, v=0.5)
  tell("optimovej", get_target_joint_positions())
  optimovel(pose_trans(start, p[0, 0, -0.05, 0, 0, 0]), a=0.5, v=0.5)
  tell("optimovel", get_actual_tcp_pose())
"""
NUMBERS = (41, -8)


def told_by(minor, more=""):
    """Run the program to its end and return the robot, where its arm began, and what the peer heard."""
    robot = make_robot(version=ControllerVersion(minor=minor))
    run(robot, 5)
    q_rad = robot.machine.world.data.qpos[:6].copy()
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(10.0)
        robot.submit_script(PROGRAM.format(port=server.getsockname()[1], more=more))
        run(robot, 5)
        peer, _ = server.accept()
        with peer:
            peer.sendall(struct.pack(">2i", *NUMBERS))
            ended(robot, 20_000)
            peer.settimeout(10.0)
            heard = b"".join(iter(lambda: peer.recv(65_536), b""))
    told: dict = {"sent_int": struct.unpack(">i", heard[-4:])[0]}
    for line in heard[:-4].decode().splitlines():
        name, _, value = line.partition(" ")
        with suppress(ValueError, SyntaxError):
            told[name] = ast.literal_eval(value.removeprefix("p"))
        told.setdefault(name, value)
    assert any("all told" in line for line in lines(robot)), lines(robot)[-5:]
    assert not any("after halt" in line for line in lines(robot))
    return robot, q_rad, told


@pytest.fixture(scope="module")
def ran():
    return told_by(11)


def off(told, name, expected):
    return float(np.abs(np.array(told[name], dtype=float) - np.array(expected)).max())


def test_each_builtin_that_tells_joints_and_tool_tells_the_twins(ran):
    _, q_rad, told = ran
    assert told["echo"] == sum(NUMBERS)
    assert told["steptime"] == 0.002
    for name in ("joint_positions", "actual_joint_positions", "target_joint_positions", "inverse"):
        assert off(told, name, q_rad) < 2e-3, name
    assert off(told, "target_joint_speeds", [0.2, 0, 0, 0, 0, 0]) < 1e-6
    assert off(told, "actual_joint_speeds", [0.2, 0, 0, 0, 0, 0]) < 0.01
    history = np.array(told["history_now"]) - np.array(told["history_50"])
    assert np.abs(history - [0.02, 0, 0, 0, 0, 0]).max() < 1e-3
    assert told["tcp_speed_turning"][5] == pytest.approx(0.2, abs=0.01)
    for name in ("tcp_speed_rising", "target_tcp_speed"):
        assert off(told, name, [0, 0, 0.05, 0, 0, 0]) < 0.01, name


def test_each_builtin_that_moves_leads_where_it_should(ran):
    _, q_rad, told = ran
    assert off(told, "movej", q_rad) < 2e-3
    start = told["movel"]
    assert told["movep"][2] == pytest.approx(start[2] + 0.05, abs=5e-3)
    assert off(told, "movec", start) < 5e-3
    assert told["servoj"][5] == pytest.approx(q_rad[5] + 0.1, abs=5e-3)


def test_force_is_zeroed_told_and_complied_with(ran):
    robot, _, told = ran
    assert np.linalg.norm(told["force_zeroed"][:3]) < 0.5
    assert np.linalg.norm(told["force_payload_1kg"][:3]) < 0.5
    assert np.linalg.norm(told["force_zeroed_again"][:3]) < 0.5
    assert told["after_force"][2] - told["before_force"][2] > 2e-3
    assert robot.machine.force_damping == 0.05
    assert told["contact_in_the_air"] == 0
    assert told["freedrive_status"] == 0


def test_what_is_set_is_told_and_arrives(ran):
    robot, _, told = ran
    assert told["target_payload"] == 1.5
    assert off(told, "target_payload_cog", [0.0, 0.0, 0.06]) == 0.0
    assert off(told, "gravity", [0.0, 0.0, 9.81]) == 0.0
    assert off(told, "tcp_offset", [0, 0, 0.16, 0, 0, 0]) == 0.0
    assert robot.machine.io.tool_voltage_v == 24
    assert robot.machine.io.digital_out >> 3 & 1
    assert told["digital_out"] is True or told["digital_out"] == "True"
    assert (told["norm"], told["pow"]) == (5.0, 1024)
    assert told["sent_int"] == -2
    journal = " ".join(lines(robot))
    assert "a word" in journal
    assert "external force sensor: on" in journal
    assert "external force sensor: off" in journal


def test_what_can_be_reached_and_what_is_allowed_is_told_and_lists_are_reckoned_with(ran):
    _, _, told = ran
    assert (told["reachable"], told["out_of_reach"]) == (True, False)
    assert (told["within_limits"], told["beyond_limits"]) == (True, False)
    assert told["list_sum"] == [21, 42, 63]


@pytest.mark.slow
def test_torques_the_mass_matrix_and_optimised_moves_came_with_later_versions():
    _, q_rad, told = told_by(26, TORQUES)
    assert np.array(told["mass_matrix"]).shape == (6, 6)
    assert off(told, "optimovej", q_rad) < 2e-3
    assert told["optimovel"][2] == pytest.approx(told["movel"][2] + 0.05, abs=5e-3)
