"""A cell's wiring: at which terminal of the control box each of the table's signals is, and how it behaves there."""

from typing import Annotated

from msgspec import Meta

from config.values import Name, Section

__all__ = ["N_SIGNALS", "CellAnalogInput", "CellConfig", "CellInput", "CellOutput", "pin_number"]

N_SIGNALS = 16
_FIRST = {"D": 0, "C": 8, "A": 0}

Signal = Annotated[int, Meta(ge=0, lt=N_SIGNALS)]
"""The number that a scenario gives an input (of a button or a box's sensor) or an output (of a lamp or a lid)."""
InputPin = Annotated[str, Meta(pattern=r"^(DI|CI)[0-7]\Z")]
OutputPin = Annotated[str, Meta(pattern=r"^(DO|CO)[0-7]\Z")]
AnalogInputPin = Annotated[str, Meta(pattern=r"^AI[01]\Z")]
Volts = Annotated[float, Meta(ge=0.0, le=10.0)]


class CellInput(Section, frozen=True, kw_only=True):
    """One sensed signal."""

    signal: Signal
    pin: InputPin
    """As printed on the control box: DI0 to DI7 standard, CI0 to CI7 configurable."""
    inverted: bool = False
    """The terminal is high while the signal is off, as with a contact that opens when pressed."""


class CellOutput(Section, frozen=True, kw_only=True):
    """One driven signal: a level, or a drive with two coils that takes a pulse on either."""

    signal: Signal
    pin: OutputPin
    inverted: bool = False
    """The terminal is low while the signal is on. Levels only."""
    off_pin: OutputPin | None = None
    """With it the drive is bistable: a pulse on `pin` switches it on, one on `off_pin` off."""
    pulse_s: Annotated[float, Meta(ge=0.02, le=5.0)] | None = None
    """How long a pulse is; for a bistable drive only."""


class CellAnalogInput(Section, frozen=True, kw_only=True):
    """How far a button is pressed, as a voltage beside its contact, for other readers of the controller than this."""

    signal: Signal
    """The number of the button's input."""
    pin: AnalogInputPin
    """As printed on the control box: AI0 or AI1."""
    volts: tuple[Volts, Volts] = (0.0, 10.0)
    """Released, and at the end of its travel; in between in proportion."""


class CellConfig(Section, frozen=True, kw_only=True):
    """Where a UR control box has the table's buttons, sensors, lamps and lids."""

    name: Name
    description: str = ""
    inputs: Annotated[tuple[CellInput, ...], Meta(min_length=1, max_length=N_SIGNALS)]
    outputs: Annotated[tuple[CellOutput, ...], Meta(min_length=1, max_length=N_SIGNALS)]
    analog_inputs: Annotated[tuple[CellAnalogInput, ...], Meta(max_length=2)] = ()
    arming_signal: Signal | None = None
    """Number of the input whose press arms after it was asked for; a button at the cell. None: only a console arms."""


def pin_number(pin: str) -> int:
    """Return a terminal's number as RTDE has it: standard 0 to 7, configurable 8 to 15; analogue ones 0 and 1."""
    return _FIRST[pin[0]] + int(pin[2])
