"""Episodes of a drive: which are kept, which are not, and the table laid out anew between them. State."""

from collections.abc import Callable
from typing import Protocol

from robot.recording.messages import EpisodeEnd, EpisodeMark
from robot.station import Station
from robot.teleop.device import EpisodeKey

__all__ = ["Episodes"]

ENDS = {
    EpisodeKey.NEXT: EpisodeEnd.KEPT,
    EpisodeKey.REDO: EpisodeEnd.REDONE,
    EpisodeKey.DISCARD: EpisodeEnd.DISCARDED,
}


class _Marks(Protocol):
    """Takes marks, where a drive is recorded."""

    def mark(self, mark: EpisodeMark) -> None:
        """Take one."""
        ...


class Episodes:
    """Counts episodes, marks them and lays the table out for each.

    Args:
        station: engaged when an episode is begun.
        marks: of the recording; None where there is none.
        seed: of the tables.
        lays_out: the plant lays its table out by itself, so that each episode has one of its own; else whoever drives
            sees to it, and only marks are made.

    Attributes:
        n_kept: Episodes so far that are kept.
    """

    def __init__(self, station: Station, *, marks: _Marks | None, seed: int, lays_out: bool) -> None:
        self._station, self._marks, self._seed, self._lays_out = station, marks, seed, lays_out
        self._number = self._table = self.n_kept = 0
        self._is_open = False

    def begin(self) -> None:
        """Begin one: a table is laid out for it."""
        self._mark(None)
        self._is_open = True
        if self._lays_out:
            self._station.reset(seed=self._seed, epoch=self._table)

    def end(self, key: EpisodeKey) -> None:
        """End the one in hand and begin the next: of another table, unless it is done again. The arm is at rest."""
        self._close(ENDS[key])
        self._table += key is not EpisodeKey.REDO
        self.begin()

    def quit(self) -> None:
        """End the last one, which is kept; of a drive that latched nothing is open then. Idempotent."""
        self._close(EpisodeEnd.KEPT)

    def void(self, go_on: Callable[[], bool]) -> bool:
        """Drop the one in hand, for the arm has latched; begin another if somebody arms it again.

        Args:
            go_on: asks for that.
        """
        self._close(EpisodeEnd.DISCARDED)
        is_armed = go_on()
        if is_armed:
            self._table += 1
            self.begin()
        return is_armed

    def _close(self, end: EpisodeEnd) -> None:
        if self._is_open:
            self._mark(end)
            self.n_kept += end is EpisodeEnd.KEPT
            self._number, self._is_open = self._number + 1, False

    def _mark(self, end: EpisodeEnd | None) -> None:
        if self._marks is not None:
            self._marks.mark(EpisodeMark(number=self._number, table=self._table, end=end))
