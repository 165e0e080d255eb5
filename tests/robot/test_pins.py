"""Signals and terminals: swapped pins, polarity, pulses of drives with two coils."""

from config.cell import CellConfig, CellInput, CellOutput, pin_number
from robot.hal.pins import Pins, straight_cell

MS = 1_000_000
CELL = CellConfig(
    name="odd",
    inputs=(CellInput(signal=0, pin="CI3"), CellInput(signal=1, pin="DI0", inverted=True)),
    outputs=(
        CellOutput(signal=0, pin="CO7"),
        CellOutput(signal=1, pin="DO0", inverted=True),
        CellOutput(signal=2, pin="DO4", off_pin="DO5", pulse_s=0.1),
    ),
)
OTHERS = 0b1100


def bits(*pins):
    return sum(1 << pin_number(pin) for pin in pins)


def test_terminals_are_numbered_as_rtde_numbers_them():
    assert [pin_number(pin) for pin in ("DI0", "DO7", "CI0", "CO7")] == [0, 7, 8, 15]


def test_inputs_are_told_by_signal_whatever_their_pins_and_polarity():
    pins = Pins(CELL)
    assert pins.signals_in(bits("DI0")) == 0b00
    assert pins.signals_in(bits("DI0", "CI3")) == 0b01
    assert pins.signals_in(0) == 0b10
    assert pins.signals_in(bits("DI5")) == 0b10


def test_levels_follow_their_signal_and_other_terminals_are_let_alone():
    pins = Pins(CELL)
    put = pins.pins_out(0b001, OTHERS, now_ns=0)
    assert put & bits("CO7", "DO0") == bits("CO7", "DO0")
    assert put & OTHERS == OTHERS
    put = pins.pins_out(0b010, put, now_ns=200 * MS)
    assert put == OTHERS
    assert pins.signals_out(put) == 0b010


def test_a_bistable_drive_gets_one_pulse_a_change_of_its_length():
    pins = Pins(CELL)
    coils = bits("DO4", "DO5")

    def put(signals, ms):
        return pins.pins_out(signals, 0, now_ns=ms * MS) & coils

    assert put(0b000, 0) == bits("DO5")  # nobody knows how it stands: it is told
    assert put(0b000, 99) == bits("DO5")
    assert put(0b000, 100) == 0
    assert put(0b100, 500) == bits("DO4")
    assert put(0b100, 599) == bits("DO4")
    assert put(0b100, 600) == 0
    assert put(0b100, 5000) == 0
    assert pins.signals_out(bits("DO0")) == 0b100
    assert put(0b000, 6000) == bits("DO5")
    assert put(0b100, 6050) == bits("DO4")  # never both coils at once
    assert pins.rested(coils | OTHERS) == OTHERS
    pins.forget()
    assert put(0b100, 6060) == bits("DO4")


def test_a_rig_without_a_cell_is_wired_straight_through():
    pins = Pins()
    assert pins.signals_in(0xA5C3) == 0xA5C3
    assert pins.pins_out(0x5A3C, 0, now_ns=0) == 0x5A3C
    assert pins.signals_out(0x5A3C) == 0x5A3C
    assert len(straight_cell().inputs) == len(straight_cell().outputs) == 16
