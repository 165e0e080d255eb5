"""The virtual robot without ports: slice by slice, the same every time."""

import math
import struct

import msgspec
import numpy as np
import pytest

from sim_twin.controller.io import InputsOutputs
from sim_twin.controller.pacing import Pacer
from sim_twin.controller.registers import Registers
from sim_twin.controller.server import ControllerServer, Setup, parse_version
from sim_twin.controller.states import Event, RobotMode, RuntimeState, SafetyMode
from sim_twin.controller.watchdogs import WatchdogAction, Watchdogs
from sim_twin.controller.wire import ControllerVersion, GripperRequest, Outcome, output_fields
from sim_twin.names import on_table
from tests.support.virtual_robot import make_robot, run

STOPPED, PLAYING, PAUSED = RuntimeState.STOPPED, RuntimeState.PLAYING, RuntimeState.PAUSED
FOREVER = "def waits():\n  while True:\n    sync()\n  end\nend\n"


def started(text, **settings):
    robot = make_robot(**settings)
    robot.submit_script(text)
    run(robot, 5, lambda: robot.machine.modes.runtime is PLAYING)
    return robot


def lines(robot):
    return [text for _, text in robot.machine.journal.lines]


def state_of(robot):
    return robot.machine.modes.runtime


def ended(robot, n=2000):
    return run(robot, n, lambda: state_of(robot) is STOPPED)


# ------------------------------------------------------------------------------------------------------------ programs


def test_the_same_program_moves_the_same_way_twice():
    ends = []
    for _ in range(2):
        robot = started("def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 0.2\n movej(q, a=3, v=1)\nend\n")
        n = ended(robot)
        ends.append((n, robot.machine.world.data.qpos.tolist()))
    assert ends[0] == ends[1]


def test_a_program_that_fails_tells_its_line_on_the_primary_port():
    robot = started("def f():\n sync()\n movej([1, 2])\nend\n")
    ended(robot)
    assert any("program f, thread f, line 3" in line for line in lines(robot))
    assert any(b"movej" in message for message in robot.machine.journal.outbox)


def test_a_text_that_does_not_parse_is_reported_and_harms_nothing():
    robot = started(FOREVER)
    robot.submit_script("def f():\n if\nend\n")
    run(robot, 3)
    assert state_of(robot) is PLAYING
    assert any("line 3, column 1: expected a value, got 'end'" in line for line in lines(robot))
    assert robot.machine.journal.outbox[-1].endswith(b"syntax_error_on_line:3:end:")


@pytest.mark.parametrize(
    ("text", "name", "line", "column"),
    [
        ("def illegal_fun():\n  calldoesntexist()\nend", "calldoesntexist", 2, 3),
        ("def f():\n movej([0, -1, 1, 0, 0, 0])\n foo(1)\nend\n", "foo", 3, 2),
        ("def f():\n sync()\n if False:\n  foo(1)\n end\nend\n", "foo", 4, 3),
        ("def f():\n def g():\n  return 1 + missing\n end\n sync()\nend\n", "missing", 3, 14),
        ("def f():\n sync()\n h = run nobody()\nend\n", "nobody", 3, 10),
        ("sec s():\n foo()\nend\n", "foo", 2, 2),
    ],
)
def test_a_name_that_nothing_has_is_reported_with_its_place_and_nothing_starts(text, name, line, column):
    robot = make_robot()
    run(robot, 3)
    before = robot.machine.world.data.qpos[:6].copy()
    robot.submit_script(text)
    run(robot, 200)
    said = list(robot.machine.journal.outbox)
    assert len(said) == 1
    assert said[0].endswith(struct.pack(">II", line, column) + f"compile_error_name_not_found:{name}:".encode())
    assert state_of(robot) is STOPPED
    assert np.abs(robot.machine.world.data.qpos[:6] - before).max() < 1e-4
    assert not any("STARTED" in line for line in lines(robot))


def test_a_secondary_program_that_fails_says_so_as_a_robot_does():
    robot = make_robot()
    robot.submit_script("sec side():\n set_digital_out(99, True)\nend\n")
    run(robot, 3)
    assert b"SECONDARY_PROGRAM_EXCEPTION_XXXset_digital_out(): expected" in robot.machine.journal.outbox[-1]


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


def test_a_sec_that_takes_time_is_reported():
    robot = make_robot()
    robot.submit_script("sec slow():\n sleep(1)\nend\n")
    run(robot, 2)
    assert any("physical time" in line for line in lines(robot))


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
            robot.machine.write("input_int_register_3", k)
        robot.step()
    assert state_of(robot) is PLAYING
    run(robot, 12)
    assert state_of(robot) is STOPPED


def test_the_dashboard_plays_pauses_and_stops_what_is_loaded():
    robot = make_robot()
    robot.programs.shelf["/programs/a.urp"] = FOREVER
    panel = robot.panel
    assert panel.play() is Outcome.FAILED
    assert panel.load("/programs/b.urp") is Outcome.NOT_FOUND
    assert panel.load("/programs/a.urp") is Outcome.DONE
    assert panel.play() is Outcome.DONE
    run(robot, 3)
    assert panel.status().program_state == "PLAYING"
    assert panel.pause() is Outcome.DONE
    run(robot, 3)
    assert state_of(robot) is PAUSED
    assert panel.play() is Outcome.DONE
    run(robot, 3)
    assert state_of(robot) is PLAYING
    assert panel.stop() is Outcome.DONE
    ended(robot)


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
        " while i < 150:\n  direct_torque([8, 0, 0, 0, 0, 0])\n  i = i + 1\n end\nend\n"
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


def test_a_target_that_is_no_number_moves_nothing():
    robot = make_robot()
    robot.machine.write("input_double_register_0", math.nan)
    robot.submit_script(
        "def f():\n q = get_actual_joint_positions()\n q[0] = read_input_float_register(0)\n servoj(q)\nend\n"
    )
    before = robot.machine.world.data.qpos[:6].copy()
    run(robot, 300)
    assert state_of(robot) is not PLAYING
    assert robot.machine.world.data.qpos[:6] == pytest.approx(before, abs=1e-3)


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


def test_every_output_has_a_getter_and_fits_its_type():
    robot = make_robot()
    robot.step()
    for version in (ControllerVersion(major=3, minor=15), ControllerVersion(), ControllerVersion(minor=26)):
        for name, kind in output_fields(version).items():
            value = robot.outputs[name]()
            assert (len(value) if kind.n_items > 1 else 1) == kind.n_items, name
    assert robot.outputs["timestamp"]() == pytest.approx(0.002)
    assert math.dist(robot.outputs["elbow_position"](), (0, 0, 0.1625)) == pytest.approx(0.425, abs=1e-6)


# ----------------------------------------------------------------------------------------------------------------- hand


def settle(robot, n=3000):
    run(robot, 5)
    run(robot, n, lambda: robot.hand.measure().obj != 0 and robot.hand.measure().sta != 1)


def test_a_hand_that_was_not_activated_stays_and_says_so():
    robot = make_robot()
    before = robot.hand.opening_m
    robot.hand.request(GripperRequest(gto=1, pos=255))
    run(robot, 100)
    assert robot.hand.opening_m == pytest.approx(before, abs=1e-3)
    assert robot.hand.measure().flt == 7


def test_activation_strokes_open_and_shut():
    robot = make_robot()
    assert robot.hand.measure().sta == 0
    seen = []
    robot.hand.request(GripperRequest(act=1))
    for _ in range(2000):
        robot.step()
        seen.append(robot.hand.measure().pos)
        if robot.hand.measure().sta == 3:
            break
    assert robot.hand.measure().sta == 3
    assert min(seen) <= 3
    assert max(seen) >= 250


@pytest.mark.parametrize("pos", [0, 100, 255])
def test_the_fingers_go_where_they_are_asked(pos):
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=pos, spe=255, force=100))
    settle(robot)
    measured = robot.hand.measure()
    assert abs(measured.pos - pos) <= 4
    assert measured.obj == 3
    assert measured.pre == pos


def test_what_is_between_the_fingers_is_told():
    robot = make_robot()
    world = robot.machine.world
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255, force=0))
    settle(robot)
    address = int(world.model.joint(on_table(world.scenario.cylinders[0].name)).qposadr[0])
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255, force=0))
    seen = []
    for _ in range(1000):
        # Held up by hand until the fingers have it.
        world.data.qpos[address : address + 3] = world.data.site("tcp").xpos
        robot.step()
        seen.append(robot.hand.measure().obj)
    assert seen[:3] == [0, 0, 0]
    assert seen[-1] == 2
    assert 20 < robot.hand.measure().pos < 240
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255, force=0))
    settle(robot)
    assert robot.hand.measure().obj == 3


def test_a_protective_stop_does_not_touch_the_hand():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.programs.handle(Event.PROTECTIVE_STOP)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=128, spe=255, force=0))
    settle(robot)
    assert abs(robot.hand.measure().pos - 128) <= 4


# --------------------------------------------------------------------------------------------------------------- pieces


def test_registers_keep_what_fits_and_refuse_the_rest():
    registers = Registers()
    assert registers.write("input_int_register_47", -5)
    assert registers.write("input_bit_registers32_to_63", 0b101)
    assert not registers.write("speed_slider_mask", 1)
    assert registers.inputs.int_at(47) == -5
    assert [registers.inputs.bit_at(i) for i in (32, 33, 34)] == [True, False, True]
    assert registers.getters()["input_bit_registers32_to_63"]() == 0b101
    registers.outputs.set_int(0, 2**31)
    assert registers.outputs.int_at(0) == -(2**31)
    for i in (-1, 48):
        with pytest.raises(ValueError, match="register"):
            registers.outputs.set_int(i, 0)


def test_two_packages_in_one_slice_both_count():
    io = InputsOutputs(set_slider=lambda _: None)
    for bit in (0, 5):
        io.write("standard_digital_output_mask", 1 << bit)
        io.write("standard_digital_output", 1 << bit)
    io.write("configurable_digital_output", 0b1)
    io.write("configurable_digital_output_mask", 0b1)
    io.apply()
    assert io.digital_out == 1 | 1 << 5 | 1 << 8
    io.apply()
    io.set_digital_out(5, False)
    io.apply()
    assert io.digital_out == 1 | 1 << 8, "what was written once is not written again"


@pytest.mark.parametrize(
    ("fraction", "moves"), [(0.0, True), (1.0, True), (1.1, False), (-0.1, False), (math.nan, False)]
)
def test_the_slider_takes_shares_only(fraction, moves):
    seen = []
    io = InputsOutputs(set_slider=seen.append)
    io.write("speed_slider_mask", 1)
    io.write("speed_slider_fraction", fraction)
    io.apply()
    assert bool(seen) is moves


@pytest.mark.parametrize(("frequency_hz", "n_slices"), [(500.0, 1), (100.0, 5), (10.0, 50), (3.0, 167)])
def test_a_watchdog_bites_in_the_slice_after_its_time(frequency_hz, n_slices):
    watchdogs = Watchdogs()
    watchdogs.set("a", frequency_hz, WatchdogAction.STOP)
    assert all(watchdogs.tick() is None for _ in range(n_slices))
    assert watchdogs.tick() == ("a", WatchdogAction.STOP)
    assert watchdogs.tick() is None, "once"


def test_a_slept_through_slot_is_skipped_and_counted():
    now, slept = [0], []

    def sleep(seconds):
        slept.append(seconds)
        now[0] += round(seconds * 1e9)

    pacer = Pacer(period_ns=2_000_000, now_ns=lambda: now[0], sleep=sleep)
    pacer.wait()
    assert now[0] == 2_000_000
    now[0] += 9_000_000
    pacer.wait()
    assert pacer.n_missed == 3
    pacer.wait()
    assert now[0] == 12_000_000
    assert pacer.n_missed == 3


def test_only_loopback_is_listened_on_unless_asked():
    with pytest.raises(ValueError, match="loopback"):
        ControllerServer(Setup(host="10.1.2.3"))


@pytest.mark.parametrize("text", ["", "5", "a.b", "1.2.3.4.5", "5.-1"])
def test_a_version_is_numbers(text):
    with pytest.raises(ValueError, match="version"):
        parse_version(text)
    assert str(parse_version("5.23.1")).startswith("5.23.1.")


def test_noise_is_seen_by_interfaces_and_not_by_physics():
    robot = make_robot()
    bias = np.array([0.01, 0, 0, 0, 0, 0])
    robot.disturb = lambda m: msgspec.structs.replace(m, q_rad=m.q_rad + bias)
    run(robot, 5)
    off = np.array(robot.outputs["actual_q"]()) - robot.machine.world.data.qpos[:6]
    assert off == pytest.approx(bias)
    assert robot.machine.modes.safety is SafetyMode.NORMAL


def test_a_hand_without_power_is_dead_and_comes_back_reset():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1, gto=1, spe=255))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255))
    run(robot, 60)
    robot.panel.power_off()
    run(robot, 20)
    standing_m = robot.hand.opening_m
    assert 0.02 < standing_m < 0.08
    robot.hand.request(GripperRequest(act=1, gto=1, pos=255, spe=255))
    run(robot, 300)
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=2e-3)
    robot.panel.brake_release()
    run(robot, 2000, lambda: robot.hand.measure().is_powered)
    assert (robot.hand.measure().sta, robot.hand.requested) == (0, GripperRequest())


def test_an_activation_that_is_taken_back_stands_where_it_is():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    run(robot, 5000, lambda: robot.hand.opening_m < 0.06)
    robot.hand.request(GripperRequest(act=0))
    run(robot, 20)
    standing_m = robot.hand.opening_m
    run(robot, 300)
    assert robot.hand.measure().sta == 0
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=1e-3)


def test_fingers_that_are_told_to_go_no_further_stand():
    robot = make_robot()
    robot.hand.request(GripperRequest(act=1))
    settle(robot)
    robot.hand.request(GripperRequest(act=1, gto=1, pos=0, spe=255))
    run(robot, 1000, lambda: robot.hand.opening_m > 0.05)
    robot.hand.request(GripperRequest(act=1, gto=0, pos=0, spe=255))
    run(robot, 20)
    standing_m = robot.hand.opening_m
    run(robot, 300)
    assert standing_m < 0.075
    assert robot.hand.opening_m == pytest.approx(standing_m, abs=1e-3)
