"""Registers, terminals, speed slider and watchdogs of the virtual controller."""

import math

import pytest

from sim_twin.controller.io import InputsOutputs
from sim_twin.controller.registers import Registers
from sim_twin.controller.watchdogs import WatchdogAction, Watchdogs
from tests.support.virtual_robot import make_robot, run


def test_registers_keep_what_fits_and_refuse_the_rest():
    registers = Registers()
    registers.writer("input_int_register_47")(-5)
    registers.writer("input_bit_registers32_to_63")(0b101)
    assert registers.writer("speed_slider_mask") is None
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
    ("call", "bit"),
    [
        ("set_standard_digital_out(7, True)", 7),
        ("set_configurable_digital_out(0, True)", 8),
        ("set_tool_digital_out(1, True)", 17),
        ("set_digital_out(7, True)", 7),
        ("set_digital_out(8, True)", 16),
        ("set_digital_out(9, True)", 17),
        ("set_digital_out(10, True)", None),
    ],
)
def test_programs_switch_the_terminal_that_they_name_and_read_it_back(call, bit):
    robot = make_robot()
    read = call.replace("set", "get", 1).replace(", True", "")
    robot.submit_script(f"def f():\n {call}\n write_output_boolean_register(64, {read})\nend\n")
    run(robot, 20)
    assert robot.machine.io.digital_out == (0 if bit is None else 1 << bit)
    assert robot.machine.registers.outputs.bit_at(64) is (bit is not None)


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
