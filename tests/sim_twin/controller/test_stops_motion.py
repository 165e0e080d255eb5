"""Every kind of motion under every stop, on an arm: it comes to rest, the program with it, and both stay so."""

import numpy as np
import pytest

from sim_twin.controller.states import Event, PowerTimes, RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.wire import ControllerVersion
from tests.support.virtual_robot import run, started, state_of, swept_rad

NEWEST = ControllerVersion(minor=26)
PAUSED, STOPPED, PLAYING = RuntimeState.PAUSED, RuntimeState.STOPPED, RuntimeState.PLAYING
UP = "p = get_target_tcp_pose()\n u = pose_trans(p, p[0,0,-0.2,0,0,0])\n "
FORCE = "force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,{n},0,0,0], 2, [0.1,0.1,{v},0.3,0.3,0.3])"
PUSH_NM = 6.0
STILL_RAD_S = 0.01
MOTIONS = {
    "movej": "q = get_actual_joint_positions()\n q[0] = q[0] + 1.5\n movej(q, a=4, v=1.5)",
    "movel": UP + "movel(u, a=2, v=0.4)",
    "movep": UP + "movep(u, a=2, v=0.4)",
    "movec": UP + "movec(pose_trans(p, p[0.1,0,-0.1,0,0,0]), u, a=2, v=0.4)",
    "servoc": UP + "servoc(u, a=2, v=0.4)",
    "servoj": "q = get_actual_joint_positions()\n while True:\n  q[0] = q[0] + 0.001\n  servoj(q, t=0.002)\n end",
    "speedj": "while True:\n  speedj([0.5,0,0,0,0,0.5], 4, 0.002)\n end",
    "speedj, kept": "speedj([0.5,0,0,0,0,0.5], 4)\n while True:\n  sync()\n end",
    "speedj, gently": "speedj([1,0,0,0,0,0.5], 0.6, 20)",
    "speedj, then movej": (
        "while True:\n  q = get_actual_joint_positions()\n  speedj([1,0,0,0,0,0.5], 2, 0.3)\n  movej(q, a=2)\n end"
    ),
    "speedl, then movel": (UP + "while True:\n  speedl([0,0,0.1,0,0,0], 1, 0.3)\n  movel(p, a=1)\n end"),
    "speedl": "speedl([0,0,0.2,0,0,0], 2, 20)",
    "speedl, gently": "speedl([0,0,0.2,0,0,0], 0.2, 20)",
    "stopj, gently": "speedj([0.8,0,0,0,0,0.5], 8, 0.1)\n stopj(0.3)\n while True:\n  sync()\n end",
    "force mode": FORCE.format(n=100, v=0.06) + "\n while True:\n  sync()\n end",
    "force mode, asked for anew": "while True:\n  " + FORCE.format(n=100, v=0.06) + "\n  sync()\n end",
    "force mode on a path": UP + FORCE.format(n=100, v=0.3) + "\n movel(pose_trans(u, p[0.1,0,0,0,0,0]), v=0.2)",
    "freedrive": "freedrive_mode()\n while True:\n  sync()\n end",
    "freedrive, asked for anew": "while True:\n  freedrive_mode()\n  sync()\n end",
    "teach mode": "teach_mode()\n while True:\n  sync()\n end",
    "torque": "while True:\n  direct_torque([1.5,0,0,0,0,0.1])\n end",
    "torque, to and fro": (
        "while True:\n  i = 0\n  while i < 120:\n   direct_torque([1.5,0,0,0,0,0])\n   i = i + 1\n  end\n"
        "  while i > 0:\n   direct_torque([-1.5,0,0,0,0,0])\n   i = i - 1\n  end\n end"
    ),
}
ONTO = {
    "pause": (lambda robot: robot.panel.pause(), PAUSED),
    "safeguard": (lambda robot: robot.programs.handle(Event.SAFEGUARD_OPENED), PAUSED),
    "protective": (lambda robot: robot.programs.handle(Event.PROTECTIVE_STOP), PAUSED),
    "e-stop": (lambda robot: robot.programs.handle(Event.ROBOT_ESTOP), STOPPED),
    "stop": (lambda robot: robot.panel.stop(), STOPPED),
    "violation": (lambda robot: robot.programs.handle(Event.VIOLATION), STOPPED),
}
N_TO_REST = 260
HAPPENINGS = (
    *(Event.SAFEGUARD_OPENED, Event.SAFEGUARD_CLOSED, Event.PLAY) * 2,
    *(Event.PAUSE, Event.STOP, Event.PROTECTIVE_STOP, Event.UNLOCK_PROTECTIVE_STOP),
    *("def", "sec"),
    *(Event.ROBOT_ESTOP, Event.ROBOT_ESTOP_RELEASED, Event.BRAKE_RELEASE),
    *(0.0, 0.05, 0.05, 0.5, 1.0),
)
FASTEST_RAD_S = 2.0
"""No motion above asks for more, and no slider or stop may make it more; torques are under no speed's control."""


def moving(motion, n=90):
    """Return a robot that is moved so, a hand pushing where it is to be led."""
    robot = started(f"def moves():\n {MOTIONS[motion]}\nend\n", version=NEWEST)
    data = robot.machine.world.data
    if "freedrive" in motion or motion == "teach mode":
        data.qfrc_applied[0] = PUSH_NM
    run(robot, n)
    assert float(np.abs(data.qvel[:6]).max()) > 0.03, "it was not moving"
    return robot


@pytest.mark.parametrize(
    "stop", [pytest.param(stop, marks=() if state is PAUSED else pytest.mark.slow) for stop, (_, state) in ONTO.items()]
)
@pytest.mark.parametrize("motion", MOTIONS)
def test_whatever_moves_comes_to_rest_under_a_stop_and_stays_there(motion, stop):
    robot = moving(motion)
    bring, state = ONTO[stop]
    bring(robot)
    run(robot, N_TO_REST, lambda: state_of(robot) is state)
    run(robot, 25)
    assert swept_rad(robot, 75) < 1e-3
    core = robot.machine.drive.core
    assert (state_of(robot), core.force_task, core.is_free) == (state, None, False)
    is_cut = stop in ("e-stop", "violation")
    assert robot.machine.modes.robot is (RobotMode.POWER_OFF if is_cut else RobotMode.RUNNING)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_program_goes_on_after_a_pause_without_a_jump(motion):
    robot = moving(motion)
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    run(robot, N_TO_REST, lambda: state_of(robot) is PAUSED)
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    run(robot, 60)
    assert (state_of(robot), robot.machine.modes.safety) == (PLAYING, SafetyMode.NORMAL)


@pytest.mark.parametrize("motion", ["force mode", "freedrive"])
def test_what_complies_does_so_again_only_where_the_program_asks(motion):
    robot = moving(motion)
    robot.panel.pause()
    run(robot, N_TO_REST, lambda: state_of(robot) is PAUSED)
    robot.panel.play()
    run(robot, 20)
    assert state_of(robot) is PLAYING
    assert swept_rad(robot, 150) < 1e-3


def test_a_safeguard_closed_while_the_arm_slows_down_goes_on_once_it_rests():
    robot = moving("force mode")
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    run(robot, 2)
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    run(robot, N_TO_REST, lambda: robot.machine.drive.core.force_task is None)
    assert float(np.abs(robot.machine.world.data.qvel[:6]).max()) < STILL_RAD_S
    run(robot, 2)
    assert state_of(robot) is PLAYING


def test_a_path_is_gone_on_with_where_a_safeguard_held_it_up():
    robot = moving("movej")
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    run(robot, N_TO_REST)
    held = robot.machine.world.data.qpos[0].item()
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    run(robot, 1000, lambda: state_of(robot) is STOPPED)
    assert robot.machine.world.data.qpos[0] - held > 0.5
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def happen(robot, what, text):
    """Let one thing happen; what nobody can play is sent again."""
    if what == "sec":
        robot.submit_script("sec side():\n speedj([0.5,0,0,0,0,0], 1, 1)\nend\n")
    elif what == "def" or (what is Event.PLAY and state_of(robot) is STOPPED):
        robot.submit_script(text)
    elif isinstance(what, float):
        robot.machine.drive.core.pace.set_slider(what)
    elif what is Event.STOP:
        robot.programs.stop()
    else:
        robot.programs.handle(what)


@pytest.mark.parametrize("seed", [*range(5), *(pytest.param(k, marks=pytest.mark.slow) for k in range(5, 150))])
def test_whatever_happens_in_whatever_order_the_arm_rests_under_a_stop(seed):
    draw = np.random.default_rng(seed)
    motion = sorted(MOTIONS)[draw.integers(len(MOTIONS))]
    robot = moving(motion, int(draw.integers(60, 120)))
    modes, core = robot.machine.modes, robot.machine.drive.core
    modes.times = PowerTimes(n_power_on=5, n_brake_release=5, n_before_unlock=100)
    n_pausing = n_quiet = 0
    for _ in range(draw.integers(3, 9)):
        happen(robot, HAPPENINGS[draw.integers(len(HAPPENINGS))], f"def moves():\n {MOTIONS[motion]}\nend\n")
        for _ in range(draw.choice((1, 3, 20, 80, 200, 350))):
            robot.step()
            assert robot.machine.drive.motions.setpoint.fastest_rad_s < FASTEST_RAD_S or "torque" in motion
            state = state_of(robot)
            n_pausing = n_pausing + 1 if state is RuntimeState.PAUSING else 0
            n_quiet = n_quiet + 1 if modes.is_stopped_by_safety or state in (PAUSED, STOPPED) else 0
            assert n_pausing < N_TO_REST
            if n_quiet > N_TO_REST:
                assert float(np.abs(robot.machine.world.data.qvel[:6]).max()) < STILL_RAD_S
                assert (core.force_task, core.is_free) == (None, False)
