"""A walk through a cell's wires: each input is pressed, each output switched, and what came of it is judged.

The arm is no part of it. Signals are those of the scenario, terminals those of the cell's file.
"""

from collections.abc import Callable
from typing import Protocol

import msgspec

from config.cell import CellConfig, pin_number
from robot.hal.pins import Pins

__all__ = ["Finding", "Seen", "Somebody", "Terminals", "Wire", "check_cell_wires", "judge_input", "judge_output"]

SETTLE_S, POLL_S = 0.3, 0.01
Wait = Callable[[float], object]


class Wire(msgspec.Struct, frozen=True, kw_only=True):
    """One signal of the table at its terminal."""

    signal: int
    name: str
    """Of the button or the box."""
    what: str
    """`button`, `sensor`, `lamp` or `lid`."""
    pin: str
    inverted: bool = False

    @property
    def label(self) -> str:
        """Name, part and terminal, for people."""
        return f"{self.name} {self.what} ({self.pin})"


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """What came of one wire."""

    signal: int
    name: str
    what: str
    pin: str
    ok: bool
    verdict: str


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """What the input terminals did when something was pressed and let go of."""

    before: int
    pressed: int
    after: int


class Terminals(Protocol):
    """The control box."""

    def inputs(self) -> int:
        """Return the input terminals as bits."""
        ...

    def outputs(self) -> int:
        """Return the output terminals as bits."""
        ...

    def put(self, pins: int) -> None:
        """Switch the output terminals."""
        ...


class Somebody(Protocol):
    """Who presses and looks: a person, or the truth of a virtual table."""

    def press(self, wire: Wire, is_changed: Callable[[], bool]) -> None:
        """Press it, or put a thing into the box, and wait until something changes or nothing will."""
        ...

    def release(self, wire: Wire, is_back: Callable[[], bool]) -> None:
        """Let go of it, or take the thing out."""
        ...

    def ready(self, wire: Wire) -> None:
        """Return when the output may be switched: a person's key."""
        ...

    def saw(self, wire: Wire, *, is_on: bool) -> bool:
        """Return whether the lamp is lit or dark, the lid open or shut, as asked."""
        ...


def judge_input(wire: Wire, seen: Seen) -> str:
    """Return what is wrong with an input, empty if nothing is."""
    bit = 1 << pin_number(wire.pin)
    changed = seen.before ^ seen.pressed
    if not changed:
        return "nothing seen: is it connected?"
    if changed != bit:
        return f"seen at {_names(changed)}, expected {wire.pin} alone"
    if bool(seen.pressed & bit) is wire.inverted:
        return f"the wrong way round: inverted must be {str(not wire.inverted).lower()}"
    return "" if seen.after == seen.before else "does not go back"


def judge_output(*, saw_on: bool, saw_off: bool) -> str:
    """Return what is wrong with an output, empty if nothing is."""
    if saw_on and saw_off:
        return ""
    if not saw_on and not saw_off:
        return "the wrong way round, or another terminal's"
    return "never seen on: is it connected?" if saw_off else "never seen off"


def check_cell_wires(
    *,
    cell: CellConfig,
    inputs: tuple[Wire, ...],
    outputs: tuple[Wire, ...],
    terminals: Terminals,
    somebody: Somebody,
    now_ns: Callable[[], int],
    wait_s: Wait,
) -> list[Finding]:
    """Go through the wires one by one and return a finding each.

    Args:
        cell: The wiring.
        inputs: What can be pressed or put in.
        outputs: What can be switched.
        terminals: The control box.
        somebody: Who presses and looks.
        now_ns: Monotonic time.
        wait_s: Lets so many seconds pass.
    """
    findings = []
    for wire in inputs:
        verdict = judge_input(wire, _feel(wire, terminals, somebody, wait_s))
        findings.append(_finding(wire, verdict))
    pins = Pins(cell)
    resting = pins.signals_out(terminals.outputs())
    pins.assume(0)

    def switch(signals: int) -> None:
        """Put the signals on their terminals, until pulses are over."""
        end_ns = now_ns() + round(SETTLE_S * 1e9) + pins.longest_pulse_ns
        while now_ns() < end_ns:
            terminals.put(pins.pins_out(signals, terminals.outputs(), now_ns=now_ns()))
            wait_s(POLL_S)
        terminals.put(pins.rested(pins.pins_out(signals, terminals.outputs(), now_ns=now_ns())))

    for wire in outputs:
        somebody.ready(wire)
        switch(resting | 1 << wire.signal)
        saw_on = somebody.saw(wire, is_on=True)
        switch(resting & ~(1 << wire.signal))
        saw_off = somebody.saw(wire, is_on=False)
        switch(resting)
        findings.append(_finding(wire, judge_output(saw_on=saw_on, saw_off=saw_off)))
    return findings


def _feel(wire: Wire, terminals: Terminals, somebody: Somebody, wait_s: Wait) -> Seen:
    before = terminals.inputs()
    somebody.press(wire, lambda: terminals.inputs() != before)
    wait_s(SETTLE_S)
    pressed = terminals.inputs()
    somebody.release(wire, lambda: terminals.inputs() == before)
    wait_s(SETTLE_S)
    return Seen(before=before, pressed=pressed, after=terminals.inputs())


def _finding(wire: Wire, verdict: str) -> Finding:
    return Finding(
        signal=wire.signal, name=wire.name, what=wire.what, pin=wire.pin, ok=not verdict, verdict=verdict or "ok"
    )


def _names(pins: int) -> str:
    bits = [i for i in range(16) if pins >> i & 1]
    return ", ".join(f"DI{i}" if i < 8 else f"CI{i - 8}" for i in bits)
