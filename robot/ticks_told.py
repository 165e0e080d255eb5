"""An arm's ticks on their way from the memory that they lie in to whoever records: a thread of its own. The edge."""

from collections.abc import Callable
from threading import Event, Thread

from robot.bus.errors import BusError
from robot.bus.tick_rows import TickBatch, pack_ticks
from robot.tick_ring import TickReader

__all__ = ["TickTeller"]

TELL_S = 0.05
MOST = 200
"""Ticks of one message: of 500 Hz there are 25 in that time; more catch up."""


class TickTeller:
    """Tells what every tick measured, asked for and was told, until it is closed.

    Args:
        ticks: reads them; where nobody listens they wait there, and who listens later is told the last half minute.
        put: tells some of them.
        is_read: whether anybody listens.

    Attributes:
        n_lost: Ticks that the bus did not take.
    """

    def __init__(self, ticks: TickReader, *, put: Callable[[TickBatch], object], is_read: Callable[[], bool]) -> None:
        self._ticks, self._put, self._is_read = ticks, put, is_read
        self.n_lost = 0
        self._is_over = Event()
        self._thread = Thread(target=self._run, name="ticks", daemon=True)
        self._thread.start()

    def tell(self) -> None:
        """Tell what has gathered, if somebody listens."""
        if not self._is_read():
            return
        while self._ticks.n_waiting:
            raws = self._ticks.take(MOST)
            try:
                self._put(pack_ticks(raws, n_missed=self._ticks.n_missed + self.n_lost))
            except BusError:
                self.n_lost += len(raws)

    def close(self) -> None:
        """Tell what is left and end. Idempotent."""
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._is_over.wait(TELL_S):
            self.tell()
        self.tell()
