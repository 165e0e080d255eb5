"""What no stop lets through, on an arm: secondary programs, laws that comply, whatever moves when a stop comes."""

import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.builtins.secondary import MOVING
from sim_twin.controller.motion import ForceTask
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.states import Event, RuntimeState
from sim_twin.controller.wire import ControllerVersion
from tests.support.virtual_robot import lines, make_robot, run, state_of, swept_rad

NEWEST = ControllerVersion(minor=26)
FORCE = "force_mode(p[0,0,0,0,0,0], [1,1,1,0,0,0], [20,0,20,0,0,0], 2, [0.1,0.1,0.1,0.3,0.3,0.3])"


@pytest.mark.parametrize("stop", [None, Event.PROTECTIVE_STOP, Event.SAFEGUARD_OPENED])
@pytest.mark.parametrize(
    "call",
    [
        "movej([0,-1,1,0,0,0])",
        "servoj([2.8,-1.7,2,-1.8,-1.6,-1.9])",
        "speedj([0,0,0,0,0,0.5], 40, 0.1)",
        "direct_torque([5,0,0,0,0,5])",
        FORCE,
        "freedrive_mode()",
        "teach_mode()",
        "f()",
    ],
)
def test_a_secondary_program_cannot_move_the_arm(call, stop):
    robot = make_robot(version=NEWEST)
    if stop is not None:
        robot.programs.handle(stop)
    run(robot, 5)
    robot.machine.world.data.qfrc_applied[0] = 3.0
    run(robot, 50)
    for _ in range(20):
        robot.submit_script(f"sec side():\n def f():\n  stopj(a=2)\n end\n {call}\n set_digital_out(1, True)\nend\n")
        assert swept_rad(robot, 2) < 1e-4
    assert swept_rad(robot, 50) < 1e-4
    core = robot.machine.drive.core
    assert (core.force_task, core.is_free, core.tail) == (None, False, None)
    assert robot.machine.io.digital_out == 0
    assert sum("a secondary program may not move the arm" in line for line in lines(robot)) >= 5


def test_a_secondary_program_leaves_the_motion_of_the_other_alone():
    robot = make_robot()
    robot.submit_script("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 0.3\n movej(q)\nend\n")
    run(robot, 100)
    for call in ("stopj(2)", "end_force_mode()", "freedrive_mode()"):
        robot.submit_script(f"sec side():\n {call}\nend\n")
    start = robot.machine.world.data.qpos[0]
    run(robot, 600)
    assert robot.machine.world.data.qpos[0] - start > 0.2


def test_every_function_that_moves_is_refused_to_a_secondary_program():
    robot = make_robot(version=ControllerVersion(minor=99))
    functions = program_builtins(robot.machine, Sockets(slice_s=0.002))
    motions = {name for name, call in functions.items() if call.__module__.endswith((".moves", ".speeds", ".guiding"))}
    assert motions - {"get_freedrive_status"} <= set(functions) & MOVING
    assert set(functions) >= MOVING


@pytest.mark.parametrize("law", ["force", "freedrive"])
def test_nothing_complies_where_no_program_may_move(law):
    robot = make_robot()
    run(robot, 5)
    core = robot.machine.drive.core
    if law == "force":
        core.force_mode(ForceTask(frame=(0.0,) * 6, is_compliant=(True,) * 6, wrench=(20.0, 0, 20.0, 0, 0, 0)))
    else:
        core.freedrive()
        robot.machine.world.data.qfrc_applied[0] = 8.0
    assert swept_rad(robot, 200) < 2e-3
    assert (core.force_task, core.is_free) == (None, False)


MOVES = "def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + {way}\n movej(q, a=4, v={v})\n sync()\nend\n"


def test_after_a_safeguard_and_another_stop_only_a_person_goes_on():
    robot = make_robot()
    robot.submit_script(MOVES.format(way=1.0, v=0.2))
    run(robot, 100)
    for event, n in ((Event.SAFEGUARD_OPENED, 150), (Event.PROTECTIVE_STOP, 2510)):
        robot.programs.handle(event)
        run(robot, n)
    assert robot.programs.handle(Event.UNLOCK_PROTECTIVE_STOP).refusal is None
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    assert swept_rad(robot, 200) < 1e-3
    assert state_of(robot) is RuntimeState.PAUSED
    robot.panel.play()
    assert swept_rad(robot, 200) > 0.03


def test_a_safeguard_while_nothing_runs_holds_no_later_program_up():
    robot = make_robot()
    for event in (Event.SAFEGUARD_OPENED, Event.SAFEGUARD_CLOSED):
        robot.programs.handle(event)
        run(robot, 200)
    assert robot.outputs["speed_scaling"]() == 1.0
    robot.submit_script(MOVES.format(way=0.2, v=1.0))
    assert swept_rad(robot, 400) > 0.19
    assert state_of(robot) is RuntimeState.STOPPED


def test_a_program_begins_unpaused_whatever_held_the_one_before():
    robot = make_robot()
    robot.submit_script(MOVES.format(way=1.0, v=0.2))
    run(robot, 50)
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    run(robot, 200)
    robot.panel.stop()
    run(robot, 50)
    robot.programs.handle(Event.SAFEGUARD_CLOSED)
    assert swept_rad(robot, 100) < 1e-3, "what was stopped stays stopped"
    robot.submit_script(MOVES.format(way=0.2, v=1.0))
    assert swept_rad(robot, 400) > 0.19
