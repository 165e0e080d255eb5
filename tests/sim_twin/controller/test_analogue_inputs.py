"""A button's travel as a voltage at the control box: from the physics to whoever reads the controller."""

import msgspec
import numpy as np
import pytest

from config.cell import CellAnalogInput
from robot.hal.pins import straight_cell
from sim_twin.controller.table_hands import TableHands
from tests.support.genuine_client import make_station, until
from tests.support.loopback import own_address
from tests.support.small_lab import SCENARIO
from tests.support.virtual_robot import ended, make_robot, run

CELL = """\
name: measured
inputs:
  - {signal: 0, pin: DI0}
  - {signal: 1, pin: DI1}
  - {signal: 2, pin: DI2}
outputs:
  - {signal: 0, pin: DO0}
  - {signal: 1, pin: DO1}
  - {signal: 2, pin: DO2}
analog_inputs:
  - {signal: 0, pin: AI0, volts: [0.5, 9.5]}
"""
RELEASED_V, PRESSED_V, TRAVEL_M, CLOSES_AT = 0.5, 9.5, 0.01, 0.6
BUTTON_M, STEP_M = (0.30, -0.12), 0.001
CURRENT, VOLTAGE = 0, 1


def wired(*wires):
    cell = msgspec.structs.replace(straight_cell(), analog_inputs=wires)
    robot = make_robot(cell=cell)
    return robot, TableHands(robot.machine.world)


def test_a_pressed_button_is_a_voltage_wherever_the_controller_tells_of_it():
    robot, hands = wired(CellAnalogInput(signal=1, pin="AI1", volts=(8.0, 2.0)))
    button = next(b for b in robot.machine.world.scenario.buttons if b.input == 1)
    run(robot, 100)
    assert robot.outputs["standard_analog_input1"]() == pytest.approx(8.0, abs=0.05)
    hands.act(button.name, is_on=True)
    run(robot, 500)
    board = robot.panel.primary_state().masterboard
    assert robot.outputs["standard_analog_input1"]() == pytest.approx(2.0, abs=0.05)
    assert (robot.outputs["standard_analog_input0"](), robot.outputs["analog_io_types"]()) == (0.0, 0b0011)
    assert board.analog_inputs == (0.0, robot.outputs["standard_analog_input1"]())
    assert (board.analog_input_ranges, board.analog_output_domains) == ((VOLTAGE, VOLTAGE), (CURRENT, CURRENT))
    robot.submit_script(
        "def f():\n write_output_float_register(0, get_standard_analog_in(1))\n"
        " write_output_float_register(1, get_analog_in(1))\n write_output_float_register(2, get_analog_in(3))\nend\n"
    )
    run(robot, 5)
    ended(robot)
    assert [robot.outputs[f"output_double_register_{i}"]() for i in range(3)] == pytest.approx(
        [2.0, 2.0, 0.0], abs=0.05
    )
    hands.act(button.name, is_on=False)
    run(robot, 500)
    assert robot.outputs["standard_analog_input1"]() == pytest.approx(8.0, abs=0.05)


def test_an_input_that_is_set_to_currents_sees_no_voltage_and_outputs_read_back_in_their_unit():
    robot, _ = wired(CellAnalogInput(signal=0, pin="AI0", volts=(4.0, 10.0)))
    robot.submit_script(
        "def f():\n set_standard_analog_input_domain(0, 0)\n set_analog_outputdomain(1, 1)\n"
        " set_standard_analog_out(0, 0.5)\n set_standard_analog_out(1, 0.5)\n"
        " write_output_float_register(0, get_standard_analog_out(0))\n"
        " write_output_float_register(1, get_standard_analog_out(1))\nend\n"
    )
    run(robot, 5)
    ended(robot)
    assert (robot.outputs["standard_analog_input0"](), robot.outputs["analog_io_types"]()) == (0.0, 0b1010)
    assert robot.outputs["output_double_register_0"]() == pytest.approx(0.012)
    assert robot.outputs["output_double_register_1"]() == pytest.approx(5.0)
    assert robot.panel.primary_state().masterboard.analog_outputs == pytest.approx((0.012, 5.0))


@pytest.mark.slow
def test_the_genuine_client_reads_how_far_the_arm_presses_a_button(tmp_path):
    pytest.importorskip("rtde_control", reason="the genuine client comes with `pip install autotelic[lab]`")
    scenario, cell = tmp_path / "small.yaml", tmp_path / "cell.yaml"
    scenario.write_text(SCENARIO.replace("spread_m: [0.02, 0.02]", "spread_m: [0.0, 0.0]"))
    (tmp_path / "small_rules.yaml").write_text(
        "name: small_rules\nrules:\n  - {output: chest, when: [{input: left_button, is_on: true}]}\n"
    )
    cell.write_text(CELL)
    with make_station(own_address(), scenario=str(scenario), cell=str(cell)) as station:
        control, receive = station.control, station.receive
        over = [*BUTTON_M, 0.10, *station.pose[3:]]
        assert control.moveL(over, 0.5, 2.0)
        station.rest()
        assert until(lambda: receive.getStandardAnalogInput0() == pytest.approx(RELEASED_V, abs=0.05))
        assert control.moveL([*BUTTON_M, 0.058, *over[3:]], 0.2, 1.0)
        read = []
        for k in range(14):
            assert control.moveL([*BUTTON_M, 0.057 - k * STEP_M, *over[3:]], 0.05, 1.0)
            station.rest()
            volts, is_closed = receive.getStandardAnalogInput0(), bool(receive.getActualDigitalInputBits() & 1)
            read.append((station.pose[2], volts, is_closed))
            if volts > PRESSED_V - 0.1:
                break
        assert control.moveL(over, 0.5, 2.0)
        assert until(lambda: receive.getStandardAnalogInput0() == pytest.approx(RELEASED_V, abs=0.05))
    heights, volts, closed = np.array(read).T
    is_between = (volts > RELEASED_V + 0.5) & (volts < PRESSED_V - 0.5)
    assert is_between.sum() >= 5, read
    slope = np.polyfit(heights[is_between], volts[is_between], 1)[0]
    assert slope == pytest.approx(-(PRESSED_V - RELEASED_V) / TRAVEL_M, rel=0.1)
    assert volts[-1] == pytest.approx(PRESSED_V, abs=0.1)
    closing_v = RELEASED_V + CLOSES_AT * (PRESSED_V - RELEASED_V)
    assert [bool(is_on) for is_on in closed] == [v >= closing_v for v in volts], "contact and voltage are one button's"
