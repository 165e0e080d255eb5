"""Wall time on the client's own pacing."""

from collections.abc import Callable
from time import monotonic_ns
from typing import Any

from rtde_receive import RTDEReceiveInterface

from robot.errors import StaleStateError
from robot.hal.protocols import Clock

__all__ = ["TICK_NS", "HeedingClock", "RtdeClock"]

TICK_NS = 2_000_000


class RtdeClock:
    """Wall time on the client's own pacing. A tick that was missed is skipped and counted."""

    def __init__(self) -> None:
        self._pacer: RTDEReceiveInterface | None = None
        self._start: Any = None
        self._due_ns = 0

    def pace_by(self, pacer: RTDEReceiveInterface | None) -> None:
        """Take the client that waits; None ends waiting."""
        self._pacer = pacer
        if pacer is not None:
            self._start, self._due_ns = pacer.initPeriod(), monotonic_ns() + TICK_NS

    def now_ns(self) -> int:
        """Return the host's monotonic time in nanoseconds."""
        return monotonic_ns()

    def wait_tick(self) -> int:
        """Wait for the end of the period in hand and return how many whole periods were missed."""
        if self._pacer is None:
            raise StaleStateError("arm: expected connect() before waiting for its ticks")
        self._pacer.waitPeriod(self._start)
        self._start = self._pacer.initPeriod()
        now_ns = monotonic_ns()
        n_missed = max(0, (now_ns - self._due_ns) // TICK_NS)
        self._due_ns = now_ns + TICK_NS
        return int(n_missed)


class HeedingClock:
    """A clock that looks at something after each tick.

    Args:
        clock: whose ticks.
        look: raises where nobody may wait on.
    """

    def __init__(self, clock: Clock, look: Callable[[], object]) -> None:
        self._clock, self._look = clock, look

    def now_ns(self) -> int:
        """Return the clock's time in nanoseconds."""
        return self._clock.now_ns()

    def wait_tick(self) -> int:
        """Wait for the clock's next tick, look, and return how many ticks were missed."""
        n_missed = self._clock.wait_tick()
        self._look()
        return n_missed
