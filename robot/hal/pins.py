"""The control box's terminals behind the table's signals: polarity, and pulses for drives with two coils."""

from collections.abc import Iterable

import msgspec

from config.cell import CellConfig, CellInput, CellOutput, pin_number

__all__ = ["Pins", "straight_cell"]


class _Wires:
    """Wires between terminals and signals, those that are as far apart carried together.

    Args:
        pairs: Numbers of terminal and signal of each.
    """

    def __init__(self, pairs: Iterable[tuple[int, int]]) -> None:
        masks: dict[int, int] = {}
        for pin, signal in pairs:
            masks[signal - pin] = masks.get(signal - pin, 0) | 1 << pin
        self._up = tuple((mask, n) for n, mask in masks.items() if n >= 0)
        self._down = tuple((mask, -n) for n, mask in masks.items() if n < 0)
        self.pin_mask = sum(masks.values())

    def signals(self, pins: int) -> int:
        """Return the signals that are on."""
        found = 0
        for mask, n in self._up:
            found |= (pins & mask) << n
        for mask, n in self._down:
            found |= (pins & mask) >> n
        return found

    def pins(self, signals: int) -> int:
        """Return the terminals that are on."""
        found = 0
        for mask, n in self._up:
            found |= signals >> n & mask
        for mask, n in self._down:
            found |= signals << n & mask
        return found


class _Pulsed(msgspec.Struct, frozen=True):
    """A bistable drive."""

    signal_bit: int
    on_bit: int
    off_bit: int
    pulse_ns: int


def straight_cell() -> CellConfig:
    """Return the wiring of a rig that names no cell: signal i at the i-th terminal, active high."""
    names = [f"{kind}{i}" for kind in ("D", "C") for i in range(8)]
    return CellConfig(
        name="straight",
        inputs=tuple(CellInput(signal=i, pin=f"{pin[0]}I{pin[1]}") for i, pin in enumerate(names)),
        outputs=tuple(CellOutput(signal=i, pin=f"{pin[0]}O{pin[1]}") for i, pin in enumerate(names)),
    )


class Pins:
    """Translates between signals, as scenario and cell program number them, and terminals, as RTDE numbers them.

    State: what bistable drives were told last, and until when their pulses last. Nobody can read such a drive's state,
    so that the first signals after `forget` give each of them a pulse.

    Args:
        cell: The wiring; straight through where None.
    """

    def __init__(self, cell: CellConfig | None = None) -> None:
        wiring = straight_cell() if cell is None else cell
        self._inputs = _Wires((pin_number(w.pin), w.signal) for w in wiring.inputs)
        self._inverted_in = sum(1 << w.signal for w in wiring.inputs if w.inverted)
        levels = [w for w in wiring.outputs if w.off_pin is None]
        self._levels = _Wires((pin_number(w.pin), w.signal) for w in levels)
        self._inverted_out = sum(1 << w.signal for w in levels if w.inverted)
        self._pulsed = [
            _Pulsed(1 << w.signal, 1 << pin_number(w.pin), 1 << pin_number(w.off_pin), round(w.pulse_s * 1e9))
            for w in wiring.outputs
            if w.off_pin is not None and w.pulse_s is not None
        ]
        self.output_mask = self._levels.pin_mask
        """Terminals that this cell drives."""
        self.output_mask |= sum(drive.on_bit | drive.off_bit for drive in self._pulsed)
        self.longest_pulse_ns = max((drive.pulse_ns for drive in self._pulsed), default=0)
        self._told, self._known = 0, 0
        self._in = (0, self._inputs.signals(0))
        """Terminals that were read last, and their signals: mostly they are the same again."""
        self._out = (0, self._levels.signals(0))
        self._asked = (0, self._levels.pins(self._inverted_out))
        """Signals that were asked for last, and their terminals."""
        self._pulse_end_ns: dict[int, int] = {}

    def forget(self) -> None:
        """Somebody else had the outputs meanwhile: bistable drives are told anew."""
        self._known = 0
        self._pulse_end_ns.clear()

    def assume(self, signals: int) -> None:
        """Take bistable drives to stand so: none is told before it is to change."""
        self._known = sum(drive.signal_bit for drive in self._pulsed)
        self._told = signals & self._known
        self._pulse_end_ns.clear()

    def signals_in(self, pins: int) -> int:
        """Return the inputs' signals."""
        if pins != self._in[0]:
            self._in = (pins, self._inputs.signals(pins))
        return self._in[1] ^ self._inverted_in

    def signals_out(self, pins: int) -> int:
        """Return the outputs' signals: levels as read back, bistable drives as told last."""
        if pins != self._out[0]:
            self._out = (pins, self._levels.signals(pins))
        return self._out[1] ^ self._inverted_out | self._told

    def pins_out(self, signals: int, pins: int, *, now_ns: int) -> int:
        """Return the terminals for the signals wanted now; others stay as they are.

        Args:
            signals: What is to be on.
            pins: How the output terminals are.
            now_ns: Monotonic time, by which pulses begin and end.
        """
        if signals != self._asked[0]:
            self._asked = (signals, self._levels.pins(signals ^ self._inverted_out))
        pins = pins & ~self.output_mask | self._asked[1]
        for drive in self._pulsed:
            pins |= self._pulse(drive, bool(signals & drive.signal_bit), now_ns)
        return pins

    def rested(self, pins: int) -> int:
        """Return the terminals with every pulse ended: a coil that nobody switches off any more would burn."""
        for drive in self._pulsed:
            pins &= ~(drive.on_bit | drive.off_bit)
        return pins

    def _pulse(self, drive: _Pulsed, is_on: bool, now_ns: int) -> int:
        """Return the coil of a drive that gets current now, if any does."""
        bit = drive.signal_bit
        if not self._known & bit or bool(self._told & bit) != is_on:
            self._known |= bit
            self._told = self._told | bit if is_on else self._told & ~bit
            self._pulse_end_ns[bit] = now_ns + drive.pulse_ns
        if now_ns >= self._pulse_end_ns.get(bit, now_ns):
            return 0
        return drive.on_bit if is_on else drive.off_bit
