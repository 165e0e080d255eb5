"""How the twin's table is wired to the virtual control box. Written apart from the client's side of the same wires."""

from collections.abc import Callable

from config.cell import CellConfig, pin_number
from sim_twin.controller.io import BOX_BITS

__all__ = ["Box"]


class Box:
    """Carries the table's signals to terminals and back, one slice at a time.

    A bistable drive remembers which of its coils had current last; while both have, it stays as it was.

    Args:
        cell: The wiring; None is straight through.
    """

    def __init__(self, cell: CellConfig | None = None) -> None:
        self._cell = cell
        self._thrown: dict[int, bool] = {}

    def sense(self, signals: int) -> int:
        """Return the input terminals for what the table's buttons and sensors say."""
        if self._cell is None:
            return signals
        pins = 0
        for wire in self._cell.inputs:
            is_high = bool(signals >> wire.signal & 1) is not wire.inverted
            pins |= is_high << pin_number(wire.pin)
        return pins

    def measure(self, travel: Callable[[int], float]) -> list[float]:
        """Return the voltages at the two analogue inputs (V); 0 where nothing is wired.

        Args:
            travel: Returns how far the button with an input's number is pressed, as a share.
        """
        volts = [0.0, 0.0]
        for wire in self._cell.analog_inputs if self._cell is not None else ():
            released, pressed = wire.volts
            volts[pin_number(wire.pin)] = released + (pressed - released) * travel(wire.signal)
        return volts

    def drive(self, pins: int) -> int:
        """Return what the table's lamps and lids get from the output terminals."""
        if self._cell is None:
            return pins & BOX_BITS
        signals = 0
        for wire in self._cell.outputs:
            is_high = bool(pins >> pin_number(wire.pin) & 1)
            if wire.off_pin is None:
                is_on = is_high is not wire.inverted
            else:
                is_on = self._throw(wire.signal, on=is_high, off=bool(pins >> pin_number(wire.off_pin) & 1))
            signals |= is_on << wire.signal
        return signals

    def put(self, signals: int) -> int:
        """Place bistable drives (a reset) and return the terminals with levels for the signals and no pulse."""
        if self._cell is None:
            return signals & BOX_BITS
        pins = 0
        for wire in self._cell.outputs:
            is_on = bool(signals >> wire.signal & 1)
            if wire.off_pin is not None:
                self._thrown[wire.signal] = is_on
            elif is_on is not wire.inverted:
                pins |= 1 << pin_number(wire.pin)
        return pins

    def _throw(self, signal: int, *, on: bool, off: bool) -> bool:
        if on is not off:
            self._thrown[signal] = on
        return self._thrown.get(signal, False)
