"""Clocks of arms. Only a clock knows the time; loops tick on its absolute grid."""

from collections.abc import Callable

__all__ = ["LockStepClock"]


class LockStepClock:
    """Time that passes only when somebody waits: each tick advances a world by one period.

    Attributes:
        tick_ns: Period of the grid.
    """

    def __init__(self, *, tick_s: float, advance: Callable[[], None]) -> None:
        self.tick_ns = round(tick_s * 1e9)
        self._advance = advance
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the time of the world in nanoseconds; it never goes back."""
        return self._now_ns

    def wait_tick(self) -> int:
        """Advance the world by one tick. Nothing is ever missed in lock-step: returns 0."""
        self._advance()
        self._now_ns += self.tick_ns
        return 0
