"""How fast a process's memory grows, over all its starts. State."""

__all__ = ["WARM_S", "MemorySlope"]

WARM_S = 30.0
"""What a process takes up in so long after its start is what it needs, and no leak."""
S_PER_H = 3600.0


class MemorySlope:
    """A line through what a process tells of its memory, with one slope for all its starts and a level for each."""

    def __init__(self) -> None:
        self._sxx = self._sxy = 0.0
        self.begin(0.0)

    def begin(self, now_s: float) -> None:
        """Note that the process was started (again)."""
        self._begun_s = now_s
        self._n, self._mean_s, self._mean_mb = 0, 0.0, 0.0

    def note(self, now_s: float, mb: float) -> None:
        """Take in what it holds now.

        Sums of squares about running means, after Welford (1962): sums of squares themselves lose their digits.
        """
        if now_s - self._begun_s < WARM_S:
            return
        self._n += 1
        off_s = now_s - self._mean_s
        self._mean_s += off_s / self._n
        self._mean_mb += (mb - self._mean_mb) / self._n
        self._sxx += off_s * (now_s - self._mean_s)
        self._sxy += off_s * (mb - self._mean_mb)

    @property
    def mb_h(self) -> float | None:
        """Megabytes an hour; None where it never ran for long enough to tell."""
        return None if self._sxx <= 0.0 else S_PER_H * self._sxy / self._sxx
