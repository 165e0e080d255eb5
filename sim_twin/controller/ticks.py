"""What slices cost, over the last ones."""

from collections import deque

import numpy as np

__all__ = ["TickTimes"]

N_KEPT = 5000


class TickTimes:
    """Durations of the last slices.

    Attributes:
        n_missed: Slots of the wall's grid that were skipped.
    """

    def __init__(self) -> None:
        self.n_missed = 0
        self._spent_s: deque[float] = deque(maxlen=N_KEPT)

    def add(self, spent_s: float) -> None:
        """Take in one slice."""
        self._spent_s.append(spent_s)

    def clear(self) -> None:
        """Begin anew."""
        self._spent_s.clear()

    def percentiles_us(self) -> dict[str, float]:
        """Return the median, the 99th percentile and the greatest, in µs; zeros before the first slice."""
        spent_us = np.array(self._spent_s or [0.0]) * 1e6
        p50, p99, greatest = np.percentile(spent_us, [50.0, 99.0, 100.0]).tolist()
        return {"p50": p50, "p99": p99, "max": greatest, "n": float(len(self._spent_s))}
