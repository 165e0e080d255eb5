"""Wall time for the loop: an absolute grid of 2 ms. The controller's one clock."""

import time
from collections.abc import Callable

__all__ = ["Pacer"]


class Pacer:
    """Waits for the next slot of an absolute grid.

    A slot that was slept through is skipped and counted: nothing is caught up, so that a machine that stood still goes
    on at its pace and the controller's own time falls behind.

    Args:
        period_ns: Distance of the slots.
        now_ns: Monotonic time.
        sleep: Waits some seconds.

    Attributes:
        n_missed: Slots that were skipped.
    """

    def __init__(
        self,
        *,
        period_ns: int,
        now_ns: Callable[[], int] = time.monotonic_ns,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period_ns, self._now_ns, self._sleep = period_ns, now_ns, sleep
        self._due_ns = now_ns()
        self.n_missed = 0

    def wait(self) -> None:
        """Wait for the next slot; one that has just passed is taken at once."""
        self._due_ns += self._period_ns
        ahead_ns = self._due_ns - self._now_ns()
        if ahead_ns > 0:
            self._sleep(ahead_ns * 1e-9)
            return
        n_late = -ahead_ns // self._period_ns
        self.n_missed += n_late
        self._due_ns += n_late * self._period_ns
