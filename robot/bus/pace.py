"""How often messages come and how old they are when they do. Pure state."""

from collections import deque

import msgspec

__all__ = ["Pace", "Spread", "spread_of"]

N_KEPT = 10_000


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """How durations are spread."""

    n: int
    p50_ms: float
    p99_ms: float
    max_ms: float


def spread_of(durations_ns: list[int]) -> Spread | None:
    """Return how durations are spread, by rank; None of none."""
    if not durations_ns:
        return None
    ranked = sorted(durations_ns)
    p50, p99 = (ranked[min(len(ranked) - 1, len(ranked) * percent // 100)] for percent in (50, 99))
    return Spread(n=len(ranked), p50_ms=p50 / 1e6, p99_ms=p99 / 1e6, max_ms=ranked[-1] / 1e6)


class Pace:
    """Arrivals of one topic, the last ten thousand.

    Attributes:
        n: How many there were.
    """

    def __init__(self) -> None:
        self.n = 0
        self._first_ns = self._last_ns = 0
        self._intervals_ns: deque[int] = deque(maxlen=N_KEPT)
        self._ages_ns: deque[int] = deque(maxlen=N_KEPT)

    def note(self, arrived_ns: int, age_ns: int | None) -> None:
        """Take note of a message; None is an age that cannot be told."""
        if self.n:
            self._intervals_ns.append(arrived_ns - self._last_ns)
        else:
            self._first_ns = arrived_ns
        self.n += 1
        self._last_ns = arrived_ns
        if age_ns is not None:
            self._ages_ns.append(age_ns)

    @property
    def rate_hz(self) -> float | None:
        """Over all, from the first to the last; None of fewer than two."""
        span_ns = self._last_ns - self._first_ns
        return (self.n - 1) * 1e9 / span_ns if span_ns > 0 else None

    @property
    def intervals(self) -> Spread | None:
        """Between one message and the next; None of fewer than two."""
        return spread_of(list(self._intervals_ns))

    @property
    def ages(self) -> Spread | None:
        """From the source's stamp to the arrival; None where none can be told."""
        return spread_of(list(self._ages_ns))
