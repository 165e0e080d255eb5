"""The control box's safety inputs: pairs of configurable terminals that stop the robot where they are open."""

from collections.abc import Callable, Mapping

from sim_twin.controller.states import Event

__all__ = ["SafetyTerminals", "parse_safety_input"]

_PAIRS = {"CI0": 8, "CI2": 10, "CI4": 12, "CI6": 14}
"""The first of each pair, as printed on the box, and its RTDE bit: a safety function has two channels."""
_BY_NAME: dict[str, tuple[Event | None, Event | None]] = {
    "reduced": (Event.REDUCED, Event.REDUCED_ENDED),
    "safeguard": (Event.SAFEGUARD_OPENED, Event.SAFEGUARD_CLOSED),
    "safeguard_reset": (None, Event.SAFEGUARD_RESET),
    "system_estop": (Event.SYSTEM_ESTOP, Event.SYSTEM_ESTOP_RELEASED),
}
"""What happens when an input opens, and when it closes."""


def parse_safety_input(text: str) -> tuple[str, str]:
    """Return name and terminal of a text such as system_estop=CI0.

    Raises:
        ValueError: there is no such function, or no such pair.
    """
    name, _, pin = text.partition("=")
    if name not in _BY_NAME or pin not in _PAIRS:
        raise ValueError(
            f"safety input: expected {', '.join(_BY_NAME)} and the first terminal of a pair ({', '.join(_PAIRS)}), "
            f"such as system_estop=CI0, got {text[:40]!r}"
        )
    return name, pin


class SafetyTerminals:
    """Inputs of the installation that have a safety function; all closed at first, but a reset, which is a button.

    What the table has at these terminals is not seen there.

    Args:
        pins: Terminals by function, as `parse_safety_input` returns them.

    Attributes:
        mask: RTDE's bits of the terminals.

    Raises:
        ValueError: two functions share a terminal, or one is none.
    """

    def __init__(self, pins: Mapping[str, str] | None = None) -> None:
        wired = [parse_safety_input(f"{name}={pin}") for name, pin in (pins or {}).items()]
        self._bits = {name: 3 << _PAIRS[pin] for name, pin in wired}
        self.mask = sum(set(self._bits.values()))
        if self.mask.bit_count() != 2 * len(wired):
            raise ValueError(f"safety inputs: expected functions and terminals once each, got {wired}")
        self._closed = {name: name != "safeguard_reset" for name in self._bits}

    @property
    def needs_safeguard_reset(self) -> bool:
        """A safeguard that closes waits for a button."""
        return "safeguard_reset" in self._bits

    @property
    def names(self) -> tuple[str, ...]:
        """The functions that are wired."""
        return tuple(sorted(self._bits))

    @property
    def closed(self) -> dict[str, bool]:
        """Whether each input that is wired is closed."""
        return dict(self._closed)

    def set(self, name: str, *, is_closed: bool, handle: Callable[[Event], str | None]) -> str | None:
        """Open or close an input, and return why what it brings about does not happen; None where it does.

        Raises:
            ValueError: no such function is wired.
        """
        if name not in self._bits:
            wired = ", ".join(self.names) or "none; begin the controller with --safety-input"
            raise ValueError(f"expected one of the safety inputs that are wired ({wired}), got {name[:40]!r}")
        if is_closed is self._closed[name]:
            return None
        self._closed[name] = is_closed
        event = _BY_NAME[name][is_closed]
        return None if event is None else handle(event)

    def sense(self, digital_in: int) -> int:
        """Return the digital inputs with these terminals in them: high where they are closed."""
        high = sum(bits for name, bits in self._bits.items() if self._closed[name])
        return digital_in & ~self.mask | high
