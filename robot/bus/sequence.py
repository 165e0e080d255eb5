"""Which messages of one source came, came twice, came late or never: by their numbers alone."""

from enum import Enum

__all__ = ["WINDOW", "Arrival", "SequenceWindow"]

WINDOW = 1024
"""So far back a message is still told from one that came before."""
_MASK = (1 << WINDOW) - 1


class Arrival(Enum):
    """How a message came."""

    NEW = "new"
    REORDERED = "reordered"
    """For the first time, but after one that was written later."""
    DUPLICATE = "duplicate"
    """Again, or so late that it cannot be told."""


class SequenceWindow:
    """Remembers the last numbers of one source. What was written before the first that came is not missed.

    Attributes:
        n_lost: How many between the first and the newest have not come, so far.
    """

    def __init__(self) -> None:
        self.n_lost = 0
        self._first = self._newest = -1
        self._seen = 0
        """Bit k: the newest's number less k came."""

    def note(self, sequence: int) -> Arrival:
        """Take note of a number, 0 or more, and return how it came."""
        ahead = sequence - self._newest
        if self._newest < 0:
            self._first, self._newest, self._seen = sequence, sequence, 1
            return Arrival.NEW
        if ahead > 0:
            self.n_lost += ahead - 1
            self._seen = (self._seen << ahead | 1) & _MASK if ahead < WINDOW else 1
            self._newest = sequence
            return Arrival.NEW
        bit = 1 << -ahead if -ahead < WINDOW else 0
        if not bit or self._seen & bit:
            return Arrival.DUPLICATE
        self._seen |= bit
        self.n_lost -= sequence > self._first
        return Arrival.REORDERED
