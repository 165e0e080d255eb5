"""Speeds and accelerations beyond the arm's are held to its limits and reached; jumps of servoj stay stops."""

import numpy as np
import pytest

from sim_twin.controller.motion.kinematics import KinematicsError
from sim_twin.controller.motion.limits import JOINT_SPEED_TOLERANCE_RAD_S
from sim_twin.controller.motion.poses import pose_from_matrix
from sim_twin.controller.motion.setpoint import USED_SPEED
from sim_twin.controller.states import RobotMode, RuntimeState, SafetyMode
from tests.support.motion_bench import HOME, make_bench
from tests.support.virtual_robot import lines, run, started, state_of

LIMIT_RAD_S = np.pi
USED_RAD_S = USED_SPEED * LIMIT_RAD_S
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
    assert asked[0] == pytest.approx(USED_RAD_S, rel=1e-6)
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
    assert asked[[0, 5]] == pytest.approx([USED_RAD_S, USED_RAD_S / 2], rel=1e-6)
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


FOLDED, HIGH = [0, -2.4, 1.6, -1.57, -1.57, 0], [0, -1.4, 0.3, -1.57, -1.57, 0]
SPREAD_RAD = np.array([3.0, 0.6, 0.9, 2.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 40))])
def test_joint_moves_as_fast_and_hard_as_may_be_stop_nothing(seed):
    draw = np.random.default_rng(seed)
    a = draw.choice((10, 20, 40))
    ends = [(np.array(HIGH) + draw.uniform(-1, 1, 6) * SPREAD_RAD).tolist() for _ in range(2)]
    robot = started("def f():\n" + "".join(f" movej({end}, a={a}, v=3.14)\n" for end in ends) + "end\n")
    told(robot, 3000)
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)
    assert robot.machine.drive.measured.q_rad == pytest.approx(ends[1], abs=2e-3)


@pytest.mark.parametrize(
    "motion",
    [
        "speedj([3.1,3.1,0,0,0,0], 20, 0.4)",
        "speedj([1.5,-1.5,-3.1,3.1,-3.1,3.1], 20, 0.2)",
        "i = 0\n while i < 300:\n  q[0] = q[0] + norm(0.00002 * i)\n"
        "  servoj(q, lookahead_time=0.03, gain=2000)\n  i = i + 1\n end",
    ],
)
def test_a_servos_overshoot_is_no_runaway(motion):
    robot = started(f"def f():\n movej({FOLDED}, a=3, v=2)\n q = {FOLDED}\n {motion}\n stopj(20)\nend\n")
    told(robot, 2500)
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)


@pytest.mark.parametrize("call", ["a=20, v=3.14", "a=40, v=3", "t=0.1"])
def test_a_joint_move_takes_the_tool_no_faster_than_it_may(call):
    robot = started(f"def f():\n movej([0,-3.0,0,0,0,0], a=3, v=2)\n movej([3.0,-0.1,0,0,0,0], {call})\nend\n")
    data, drive, asked = robot.machine.world.data, robot.machine.drive, 0.0
    for _ in range(3500):
        robot.step()
        asked = max(asked, float(np.linalg.norm(drive.core.target_tool()[1][:3])))
        if state_of(robot) is RuntimeState.STOPPED:
            break
    assert 2.7 < asked <= 3.0
    assert robot.machine.modes.safety is SafetyMode.NORMAL, lines(robot)
    run(robot, 60)
    assert data.qpos[:2] == pytest.approx([3.0, -0.1], abs=3e-3)


def test_a_tool_that_is_asked_to_go_too_fast_is_a_protective_stop_and_keeps_its_power():
    robot = started(
        "def f():\n movej([0,-2.8,0,0,0,0], a=3, v=2)\n q = [0,-2.8,0,0,0,0]\n s = 0\n while True:\n"
        "  s = s + 0.00005\n  if s > 0.006:\n   s = 0.006\n  end\n"
        "  q[0] = q[0] + s\n  q[1] = q[1] + s * 0.8\n"
        "  servoj(q, lookahead_time=0.03, gain=2000)\n end\nend\n"
    )
    told(robot, 2500)
    modes = robot.machine.modes
    assert (modes.safety, modes.robot) == (SafetyMode.PROTECTIVE_STOP, RobotMode.RUNNING)
    assert any("moves the tool at" in line for line in lines(robot))


@pytest.mark.parametrize("seed", range(2))
def test_a_tools_line_past_a_singular_wrist_takes_longer_and_stops_nothing(seed):
    bench, draw = make_bench(), np.random.default_rng(seed)
    moves, core, n_slowed, n_lines = bench.motions.moves, bench.motions.core, 0, 0
    while n_lines < 12:
        q = HOME + draw.uniform(-0.3, 0.3, 6)
        q[4] = draw.uniform(-0.35, -0.02)
        core.hold(q)
        goal = pose_from_matrix(bench.here()) + np.append(draw.uniform(-0.3, 0.3, 3), np.zeros(3))
        begin, speeds = len(bench.qd), core.speed_rad_s
        try:
            bench.run(moves.movel(goal, 10.0, draw.choice((0.5, 1.0, 3.0))))
        except KinematicsError:
            continue
        n_lines += 1
        fastest = float((np.abs(bench.qd[begin + 1 :]) / speeds).max())
        assert fastest <= 1.0 + 1e-3
        n_slowed += fastest > 1.0 - 1e-6
        assert bench.here()[:3, 3] == pytest.approx(goal[:3], abs=1e-6)
    assert n_slowed >= 1, "no line came to a joint's limit"
