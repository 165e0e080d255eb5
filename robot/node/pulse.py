"""How a loop goes: how often it comes round, how late, and what went wrong. Pure state, and who tells it."""

from collections.abc import Callable
from contextlib import suppress
from os import getpid
from pathlib import Path
from resource import getpagesize
from threading import Event, Thread
from time import monotonic_ns

from robot.bus.errors import BusError
from robot.bus.session import Bus
from robot.bus.station_rows import Health
from robot.bus.topics import HEALTH

__all__ = ["HealthTeller", "Pulse", "memory_mb"]

STATM = Path("/proc/self/statm")
TELL_S = 0.5


class Pulse:
    """Counts the rounds of a loop.

    Args:
        target_hz: what they should be; None where there is no such number.
        now_ns: the monotonic clock.

    Attributes:
        queue: things that wait to be done.
        doing: in words.
    """

    def __init__(self, *, target_hz: float | None = None, now_ns: Callable[[], int] = monotonic_ns) -> None:
        self._target_hz, self._now_ns = target_hz, now_ns
        self._n = self._n_told = self._n_errors = 0
        self._told_ns = self._last_ns = now_ns()
        self._late_ns = 0
        self._error = ""
        self.queue = 0
        self.doing = ""

    def beat(self) -> None:
        """Note that the loop came round."""
        now_ns = self._now_ns()
        if self._target_hz is not None and self._n:
            self._late_ns = max(self._late_ns, now_ns - self._last_ns - round(1e9 / self._target_hz))
        self._last_ns, self._n = now_ns, self._n + 1

    def fail(self, error: str) -> None:
        """Note what went wrong."""
        self._n_errors += 1
        self._error = error

    def tell(self, *, clock: int, rss_mb: float, is_leaving: bool = False) -> Health:
        """Return how it went since the last time.

        Args:
            clock: the number of the clock.
            rss_mb: memory that the process holds.
            is_leaving: it says nothing more after this.
        """
        now_ns = self._now_ns()
        n, late_ns, span_ns = self._n - self._n_told, self._late_ns, max(now_ns - self._told_ns, 1)
        if self._target_hz is not None:
            late_ns = max(late_ns, now_ns - self._last_ns - round(1e9 / self._target_hz))
        self._n_told, self._late_ns, self._told_ns = self._n, 0, now_ns
        return Health(
            pid=getpid(), clock=clock, now_ns=now_ns, rate_hz=n * 1e9 / span_ns, target_hz=self._target_hz,
            late_ms=max(0.0, late_ns / 1e6), queue=self.queue, rss_mb=rss_mb, n_errors=self._n_errors,
            last_error=self._error, doing=self.doing, is_leaving=is_leaving,
        )  # fmt: skip


def memory_mb() -> float:
    """Return the memory that this process holds."""
    try:
        return int(STATM.read_text().split()[1]) * getpagesize() / 1e6
    except (OSError, IndexError, ValueError):
        return 0.0


class HealthTeller:
    """Tells twice a second how a loop goes, from a thread of its own: a loop that hangs is told too, by its rate.

    Args:
        bus: open.
        pulse: the loop's.
    """

    def __init__(self, bus: Bus, pulse: Pulse) -> None:
        self._clock, self._pulse = bus.clock, pulse
        self._publisher = bus.publisher(HEALTH)
        self._is_over = Event()
        self._thread = Thread(target=self._run, name="health", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Tell that it leaves. Idempotent."""
        if not self._is_over.is_set():
            self._is_over.set()
            self._thread.join()
            self._tell(is_leaving=True)

    def _run(self) -> None:
        while not self._is_over.wait(TELL_S):
            self._tell(is_leaving=False)

    def _tell(self, *, is_leaving: bool) -> None:
        with suppress(BusError):  # the bus is closed: who looks for this process finds it silent
            self._publisher.put(self._pulse.tell(clock=self._clock, rss_mb=memory_mb(), is_leaving=is_leaving))
