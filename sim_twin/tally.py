"""Durations counted in bins: what an hour of ticks takes no more memory for than a second. Pure state."""

from array import array

__all__ = ["Tally"]


class Tally:
    """How many durations fell into each microsecond up to a limit; longer ones are counted together.

    Attributes:
        n: How many there were.
        n_over: How many were longer than the threshold it was made with.
    """

    def __init__(self, *, limit_us: int = 100_000, over_s: float = float("inf")) -> None:
        """Make an empty one.

        Args:
            limit_us: what is longer counts as this long.
            over_s: threshold of n_over.
        """
        self._counts, self._limit_us = array("Q", bytes(8 * (limit_us + 1))), limit_us
        self._over_s = over_s
        self.n = self.n_over = 0

    def add(self, duration_s: float) -> None:
        """Count one."""
        self._counts[min(max(round(duration_s * 1e6), 0), self._limit_us)] += 1
        self.n += 1
        self.n_over += duration_s > self._over_s

    @property
    def over_share(self) -> float:
        """Share of those that were longer than the threshold; 0 where there were none."""
        return self.n_over / self.n if self.n else 0.0

    def percentile_s(self, percent: float) -> float:
        """Return the shortest duration (to 1 µs) that so many percent do not exceed; 0 where there were none."""
        wanted, seen = self.n * percent / 100.0, 0
        for k, count in enumerate(self._counts):
            seen += count
            if count and seen >= wanted:
                return k * 1e-6
        return 0.0
