"""rtde_set_watchdog: what happens when a client stops writing an input. Counted in slices."""

import math
from enum import Enum

__all__ = ["WatchdogAction", "Watchdogs"]

SLICES_PER_S = 500.0


class WatchdogAction(Enum):
    """What a starved watchdog does to the program."""

    IGNORE = "ignore"
    PAUSE = "pause"
    STOP = "stop"


_STRICTEST_FIRST = (WatchdogAction.STOP, WatchdogAction.PAUSE)


class _Watchdog:
    def __init__(self, n_slices: int, action: WatchdogAction) -> None:
        self.n_slices, self.action = n_slices, action
        self.n_waited = 0

    @property
    def is_starved(self) -> bool:
        """Its time has run out."""
        return self.n_waited > self.n_slices


class Watchdogs:
    """The watchdogs of the program that runs; all end with it."""

    def __init__(self) -> None:
        self._watched: dict[str, _Watchdog] = {}

    def set(self, name: str, frequency_hz: float, action: WatchdogAction) -> None:
        """Expect a variable to be written so often from now on.

        The same watchdog once more is no other one: its time runs on, or a loop that sets it would keep it fed.

        Raises:
            ValueError: the frequency is not above 0.
        """
        if not frequency_hz > 0.0:
            raise ValueError(f"expected a frequency above 0 Hz, got {frequency_hz}")
        n_slices = max(1, math.ceil(SLICES_PER_S / frequency_hz - 1e-9))
        known = self._watched.get(name)
        if known is None or (known.n_slices, known.action) != (n_slices, action):
            self._watched[name] = _Watchdog(n_slices, action)

    def wrote(self, name: str) -> None:
        """Note that a client wrote a variable."""
        watched = self._watched.get(name)
        if watched is not None:
            watched.n_waited = 0

    def tick(self) -> tuple[str, WatchdogAction] | None:
        """Let one slice pass; return a variable whose time ran out, and what to do: the strictest of what is due.

        What is returned gets its time anew, and is due again if nobody writes; what gives way stays due.
        """
        for watched in self._watched.values():
            watched.n_waited += 1
        if not any(watched.is_starved for watched in self._watched.values()):
            return None
        for action in _STRICTEST_FIRST:
            due = {name: w for name, w in self._watched.items() if w.action is action and w.is_starved}
            if due:
                for watched in due.values():
                    watched.n_waited = 0
                return next(iter(due)), action
        return None

    def clear(self) -> None:
        """Forget all: the program ended."""
        self._watched.clear()
