"""Programs of the virtual robot: what starts, pauses, stops and replaces them. Without ports, the same every time."""

import gc
import math
from threading import Event as Gate

import pytest

from sim_twin.controller import program
from sim_twin.controller.compiling import InlineCompiler, ThreadCompiler
from sim_twin.controller.faults import Faults
from sim_twin.controller.states import Event, PowerTimes, RuntimeState, SafetyMode
from sim_twin.controller.wire import Outcome
from sim_twin.controller.wire.script_framer import N_PROGRAM_CHARS
from tests.support.virtual_robot import FOREVER, ended, lines, make_robot, run, started, state_of

SEC = "sec side():\n set_digital_out(3, True)\nend\n"
STOPPED, PLAYING, PAUSED = RuntimeState.STOPPED, RuntimeState.PLAYING, RuntimeState.PAUSED


def test_the_same_program_moves_the_same_way_twice():
    ends = []
    for _ in range(2):
        robot = started("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 0.2\n movej(q, a=3, v=1)\nend\n")
        n = ended(robot)
        ends.append((n, robot.machine.world.data.qpos.tolist()))
    assert ends[0] == ends[1]


def test_a_def_replaces_and_a_sec_runs_beside():
    robot = started(FOREVER)
    robot.submit_script("sec side():\n set_digital_out(3, True)\nend\n")
    run(robot, 2)
    assert robot.programs.main.name == "waits"
    assert robot.machine.world.digital_out == 1 << 3
    robot.submit_script("def other():\n while True:\n  sync()\n end\nend\n")
    run(robot, 10)
    assert robot.programs.main.name == "other"
    assert state_of(robot) is PLAYING


def test_secs_take_a_slice_each_in_their_order_whatever_they_spend():
    robot = started(FOREVER)
    before = robot.machine.world.digital_out
    for k in range(3):
        robot.submit_script(f"sec side():\n set_digital_out({k}, True)\n while True:\n  a = 1\n end\nend\n")
    seen = []
    for _ in range(4):
        run(robot, 1)
        seen.append(robot.machine.world.digital_out)
    assert before == 0
    assert seen == [0b1, 0b11, 0b111, 0b111]
    assert len([line for line in lines(robot) if "infinite loop" in line]) == 3
    assert state_of(robot) is PLAYING


def test_more_secs_than_may_wait_are_turned_away_and_say_so(monkeypatch):
    monkeypatch.setattr(program, "N_SECONDARY", 20)
    robot = started(FOREVER)
    starts = [robot.programs.submit(SEC) for _ in range(21)]
    run(robot, 1)
    assert [start.has_begun for start in starts] == [True] * 20 + [False]
    assert any("secondary programs wait" in line for line in lines(robot))


def test_a_speed_ends_with_its_program():
    robot = started("def f():\n speedj([0.3, 0, 0, 0, 0, 0], 2)\nend\n")
    ended(robot)
    run(robot, 100)
    before = robot.machine.world.data.qpos[0]
    run(robot, 50)
    assert abs(robot.machine.world.data.qpos[0] - before) < 1e-4


def test_two_threads_that_move_end_the_program():
    robot = started(
        "def f():\n thread t():\n  speedj([0.1,0,0,0,0,0],1,1)\n end\n sync()\n run t()\n"
        " speedj([0,0.1,0,0,0,0],1,1)\nend\n"
    )
    ended(robot)
    assert any("another thread is already controlling the robot" in line for line in lines(robot))


def test_a_watchdog_stops_and_a_write_keeps_it_quiet():
    robot = started(
        'def f():\n rtde_set_watchdog("input_int_register_3", 50, "stop")\n while True:\n  sync()\n end\nend\n'
    )
    for k in range(100):
        if k % 10 == 0:
            robot.machine.writer("input_int_register_3")(k)
        robot.step()
    assert state_of(robot) is PLAYING
    run(robot, 12)
    assert state_of(robot) is STOPPED


def test_the_dashboard_plays_pauses_and_stops_what_is_loaded():
    robot = make_robot()
    robot.programs.shelf["/programs/a.urp"] = FOREVER
    panel = robot.panel
    assert panel.play()() is Outcome.FAILED
    assert panel.load("/programs/b.urp") is Outcome.NOT_FOUND
    assert panel.load("/programs/a.urp") is Outcome.DONE
    awaited = panel.play()
    assert awaited() is None
    run(robot, 3)
    assert awaited() is Outcome.DONE
    assert panel.status().program_state == "PLAYING"
    assert panel.pause() is Outcome.DONE
    run(robot, 3)
    assert state_of(robot) is PAUSED
    assert panel.play()() is Outcome.DONE
    run(robot, 3)
    assert state_of(robot) is PLAYING
    assert panel.stop() is Outcome.DONE
    ended(robot)


@pytest.mark.parametrize("text", ["def f():\n if\nend\n", "def f():\n nobody()\nend\n"], ids=["syntax", "name"])
@pytest.mark.parametrize("compiler", [InlineCompiler, ThreadCompiler])
def test_play_fails_where_the_program_does_not_compile(text, compiler):
    robot = make_robot(compiler=compiler)
    robot.programs.shelf["/programs/a.urp"] = text
    robot.panel.load("/programs/a.urp")
    awaited = robot.panel.play()
    assert awaited() is None
    run(robot, 5000, awaited)
    assert awaited() is Outcome.FAILED
    assert state_of(robot) is STOPPED
    robot.close()


def test_play_fails_where_the_arm_is_stopped_before_the_program_begins():
    robot = make_robot()
    robot.programs.shelf["/programs/a.urp"] = FOREVER
    robot.panel.load("/programs/a.urp")
    awaited = robot.panel.play()
    robot.programs.handle(Event.PROTECTIVE_STOP)
    run(robot, 3)
    assert awaited() is Outcome.FAILED


def test_play_fails_where_another_program_comes_before_it_has_begun():
    robot = started(FOREVER)
    first, second = robot.programs.submit(FOREVER), robot.programs.submit(FOREVER)
    assert (first.has_begun, second.has_begun) == (None, None)
    run(robot, 10)
    assert (first.has_begun, second.has_begun) == (False, True)


@pytest.fixture
def slow():
    """A robot whose compiler's thread waits at a gate, as it does for a script of 40 kB, and that gate."""
    gate = Gate()

    def behind_the_gate(make_builtins):
        return ThreadCompiler(lambda sockets: (gate.wait(5.0), make_builtins(sockets))[1])

    robot = make_robot(compiler=behind_the_gate)
    yield robot, gate
    gate.set()
    robot.close()


def played(robot):
    robot.programs.shelf["a.urp"] = "def slow():\n set_digital_out(1, True)\n while True:\n  sync()\n end\nend\n"
    robot.panel.load("a.urp")
    return robot.panel.play()


def test_what_still_compiles_when_the_dashboard_stops_does_not_start(slow):
    robot, gate = slow
    awaited = played(robot)
    run(robot, 3)
    assert (robot.panel.stop(), awaited()) == (Outcome.DONE, None)
    gate.set()
    run(robot, 5000, awaited)
    run(robot, 20)
    assert (awaited(), state_of(robot)) == (Outcome.FAILED, STOPPED)
    assert robot.machine.io.digital_out == 0
    assert any("slow was not started: it was stopped" in line for line in lines(robot))
    awaited = played(robot)
    run(robot, 5000, awaited)
    assert (awaited(), state_of(robot)) == (Outcome.DONE, PLAYING), "the next is not dropped too"


def test_a_stop_drops_scripts_that_were_sent_before_it_and_none_that_come_after(slow):
    robot, gate = slow
    robot.submit_script("def before():\n set_digital_out(1, True)\n while True:\n  sync()\n end\nend\n")
    robot.submit_script("sec beside():\n set_digital_out(3, True)\nend\n")
    robot.panel.stop()
    robot.submit_script("def after():\n set_digital_out(2, True)\n while True:\n  sync()\n end\nend\n")
    gate.set()
    run(robot, 5000, lambda: state_of(robot) is PLAYING)
    run(robot, 20)
    assert robot.programs.main.name == "after"
    assert robot.machine.io.digital_out == 1 << 2 | 1 << 3, "no stop ends a secondary program"


def test_a_stop_drops_what_waits_for_the_arm_to_come_to_rest():
    robot = started("def f():\n speedj([0.5, 0, 0, 0, 0, 0], 2, 20)\nend\n")
    run(robot, 300)
    start = robot.programs.submit(FOREVER)
    run(robot, 2)
    assert (state_of(robot), start.has_begun) == (RuntimeState.STOPPING, None)
    robot.panel.stop()
    run(robot, 500)
    assert (state_of(robot), start.has_begun, robot.programs.main) == (STOPPED, False, None)


BACK = {
    Event.ROBOT_ESTOP: (Event.ROBOT_ESTOP_RELEASED, Event.BRAKE_RELEASE),
    Event.SYSTEM_ESTOP: (Event.SYSTEM_ESTOP_RELEASED, Event.BRAKE_RELEASE),
    Event.SAFEGUARD_OPENED: (Event.SAFEGUARD_CLOSED,),
    Event.PROTECTIVE_STOP: (Event.UNLOCK_PROTECTIVE_STOP,),
    Event.VIOLATION: (Event.RESTART_SAFETY, Event.BRAKE_RELEASE),
    Event.FAULT: (Event.RESTART_SAFETY, Event.BRAKE_RELEASE),
    Event.POWER_OFF: (Event.BRAKE_RELEASE,),
    Event.RESTART_SAFETY: (Event.BRAKE_RELEASE,),
}
"""What stops a robot, and what a person does until a program could start again."""


def stop_and_come_back(robot, event):
    robot.machine.modes.times = PowerTimes(n_power_on=5, n_brake_release=5, n_before_unlock=5)
    for each in (event, *BACK[event]):
        assert robot.programs.handle(each).refusal is None
        run(robot, 20)
    assert robot.programs.refusal is None


@pytest.mark.parametrize("event", BACK)
def test_what_still_compiles_when_the_robot_is_stopped_does_not_start_afterwards(slow, event):
    robot, gate = slow
    start = robot.programs.submit(FOREVER, is_remote=True)
    stop_and_come_back(robot, event)
    gate.set()
    run(robot, 5000, lambda: start.has_begun is not None)
    run(robot, 20)
    assert (start.has_begun, state_of(robot), robot.programs.main) == (False, STOPPED, None)
    start = robot.programs.submit(FOREVER, is_remote=True)
    run(robot, 5000, lambda: start.has_begun is not None)
    assert start.has_begun, "the next is not dropped too"


@pytest.mark.parametrize("event", [event for event in BACK if event is not Event.SAFEGUARD_OPENED])
def test_what_was_sent_during_a_stop_does_not_start_after_it(slow, event):
    robot, gate = slow
    robot.programs.handle(event)
    start = robot.programs.submit(FOREVER, is_remote=True)
    stop_and_come_back(robot, event)
    gate.set()
    run(robot, 5000, lambda: start.has_begun is not None)
    assert (start.has_begun, robot.programs.main) == (False, None)


@pytest.mark.parametrize("event", BACK)
def test_a_stop_by_safety_drops_what_waits_for_the_arm_to_come_to_rest(event):
    robot = started("def f():\n speedj([0.5, 0, 0, 0, 0, 0], 2, 20)\nend\n")
    run(robot, 300)
    start = robot.programs.submit(FOREVER)
    run(robot, 2)
    assert (state_of(robot), start.has_begun) == (RuntimeState.STOPPING, None)
    robot.programs.handle(event)
    assert start.has_begun is False
    run(robot, 500)
    assert robot.programs.main is None


def test_nothing_that_was_sent_under_remote_control_starts_in_local_control(slow):
    robot, gate = slow
    faults = Faults(robot, None, None)
    sent = [robot.programs.submit(text, is_remote=True) for text in (SEC, FOREVER)]
    local = robot.programs.submit(FOREVER.replace("waits", "pendant"))
    faults.apply("remote", on=False)
    gate.set()
    run(robot, 5000, lambda: local.has_begun is not None)
    run(robot, 5)
    assert [start.has_begun for start in (*sent, local)] == [False, False, True]
    assert robot.programs.main.name == "pendant"
    assert robot.machine.io.digital_out == 0
    faults.apply("remote", on=True)
    run(robot, 20)
    assert robot.programs.main.name == "pendant"


def test_what_was_sent_before_a_turn_to_local_control_and_back_does_not_start(slow):
    robot, gate = slow
    start = robot.programs.submit(FOREVER, is_remote=True)
    for on in (False, True):
        Faults(robot, None, None).apply("remote", on=on)
    gate.set()
    run(robot, 5000, lambda: start.has_begun is not None)
    assert start.has_begun is False


def test_a_person_s_pause_keeps_its_program_from_being_replaced_by_what_was_sent_before(slow):
    robot, gate = slow
    gate.set()
    robot.submit_script(FOREVER)
    run(robot, 5000, lambda: state_of(robot) is PLAYING)
    gate.clear()
    start = robot.programs.submit(FOREVER.replace("waits", "other"))
    assert robot.panel.pause() is Outcome.DONE
    gate.set()
    run(robot, 5000, lambda: start.has_begun is not None)
    run(robot, 20)
    assert (start.has_begun, state_of(robot), robot.programs.main.name) == (False, PAUSED, "waits")


@pytest.mark.parametrize("compiler", [InlineCompiler, ThreadCompiler])
def test_the_longest_program_is_taken_and_a_longer_one_refused_with_its_length(compiler):
    robot = make_robot(compiler=compiler)
    end = "\n while True:\n  sync()\n end\nend\n"
    longest = "def f():\n#" + "x" * (N_PROGRAM_CHARS - 10 - len(end)) + end
    assert len(longest) == N_PROGRAM_CHARS
    starts = [robot.programs.submit(longest), robot.programs.submit(longest + "\n")]
    run(robot, 5000, lambda: starts[0].has_begun is not None)
    assert [start.has_begun for start in starts] == [True, False]
    assert any(f"at most {N_PROGRAM_CHARS} characters, got {N_PROGRAM_CHARS + 1}" in line for line in lines(robot))
    robot.close()


def test_a_program_that_has_ended_leaves_nothing_to_the_garbage_collector():
    functions = "".join(f" def g{i}(a):\n  x = [1, 2, a]\n  g{i}(a)\n end\n" for i in range(100))
    text = f"def f():\n{functions} thread t():\n  sync()\n end\n run t()\n sync()\nend\n"
    robot = make_robot()
    gc.collect()
    gc.disable()
    try:
        robot.submit_script(text)
        ended(robot)
        assert gc.collect() < 200
    finally:
        gc.enable()


def test_a_program_that_ends_or_stops_itself_takes_nothing_along_that_was_sent_meanwhile(slow):
    robot, gate = slow
    gate.set()
    robot.submit_script("def f():\n sleep(0.5)\n halt\nend\n")
    run(robot, 5000, lambda: state_of(robot) is PLAYING)
    gate.clear()
    robot.submit_script(FOREVER)
    ended(robot)
    gate.set()
    run(robot, 5000, lambda: state_of(robot) is PLAYING)
    assert robot.programs.main.name == "waits"


def test_local_control_refuses_programs():
    robot = make_robot()
    robot.machine.modes.is_remote = False
    robot.submit_script(FOREVER, source=object())
    run(robot, 3)
    assert state_of(robot) is STOPPED


def test_a_paused_program_does_not_starve_its_watchdog():
    robot = started(
        'def f():\n rtde_set_watchdog("input_int_register_3", 50, "stop")\n while True:\n  sync()\n end\nend\n'
    )
    robot.programs.handle(Event.SAFEGUARD_OPENED)
    run(robot, 200)
    assert state_of(robot) is PAUSED
    assert robot.machine.modes.safety is SafetyMode.SAFEGUARD_STOP


def test_a_target_that_is_no_number_moves_nothing():
    robot = make_robot()
    robot.machine.writer("input_double_register_0")(math.nan)
    robot.submit_script(
        "def f():\n q = get_actual_joint_positions()\n q[0] = read_input_float_register(0)\n servoj(q)\nend\n"
    )
    before = robot.machine.world.data.qpos[:6].copy()
    run(robot, 300)
    assert state_of(robot) is not PLAYING
    assert robot.machine.world.data.qpos[:6] == pytest.approx(before, abs=1e-3)
