"""The states of a station and what each event does in each of them: one table. SAFETY.md draws and prints it."""

from enum import StrEnum

from robot.messages import StationMode

__all__ = ["TABLE", "Event", "next_mode"]


class Event(StrEnum):
    """What may happen to a station."""

    ARM = "arm"
    """Somebody answers for it, for one source, profile and lease."""
    ENGAGE = "engage"
    """Command is taken; everything starts from the measured state, at rest."""
    DISARM = "disarm"
    """What it was armed for is gone: its source, its profile or its lease. Or somebody lets go of it."""
    STOP = "stop"
    """Anybody says stop."""
    LATCH = "latch"
    """The gate refused, the arm stopped by itself, or nothing is known of it."""
    PLANT_RESET = "plant_reset"
    """The plant was laid out anew, or looked after by a person."""
    CLEAR_LATCH = "clear_latch"
    """Somebody answers for it that the reason is gone; only after the plant's reset."""


_D, _A, _E, _L = StationMode.DISARMED, StationMode.ARMED, StationMode.ENGAGED, StationMode.LATCHED
_REFUSED = None

TABLE: dict[StationMode, dict[Event, StationMode | None]] = {
    _D: {
        Event.ARM: _A, Event.ENGAGE: _REFUSED, Event.DISARM: _D, Event.STOP: _D, Event.LATCH: _L,
        Event.PLANT_RESET: _D, Event.CLEAR_LATCH: _REFUSED,
    },
    _A: {
        Event.ARM: _REFUSED, Event.ENGAGE: _E, Event.DISARM: _D, Event.STOP: _D, Event.LATCH: _L,
        Event.PLANT_RESET: _A, Event.CLEAR_LATCH: _REFUSED,
    },
    _E: {
        Event.ARM: _REFUSED, Event.ENGAGE: _REFUSED, Event.DISARM: _D, Event.STOP: _L, Event.LATCH: _L,
        Event.PLANT_RESET: _E, Event.CLEAR_LATCH: _REFUSED,
    },
    _L: {
        Event.ARM: _REFUSED, Event.ENGAGE: _REFUSED, Event.DISARM: _L, Event.STOP: _L, Event.LATCH: _L,
        Event.PLANT_RESET: _L, Event.CLEAR_LATCH: _A,
    },
}  # fmt: skip
"""The mode after an event in a mode; None where the event is refused and nothing changes."""


def next_mode(mode: StationMode, event: Event) -> StationMode | None:
    """Return the mode after an event, None where it is refused there."""
    return TABLE[mode][event]
