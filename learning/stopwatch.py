"""Where a run's time goes, by layer. The clock comes in from the edge; without one nothing is measured."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["Stopwatch"]


def _standing_still() -> float:
    return 0.0


class Stopwatch:
    """Books the time since the last lap to the layer that has just ended."""

    def __init__(self, now_s: Callable[[], float] = _standing_still) -> None:
        self.now_s = now_s
        self.seconds_by_layer: dict[str, float] = {}
        self.started_s = self._last_s = now_s()
        self._booked_to: str | None = None

    def lap(self, layer: str) -> None:
        """Book the time since the last lap to a layer."""
        now_s, layer = self.now_s(), self._booked_to or layer
        self.seconds_by_layer[layer] = self.seconds_by_layer.get(layer, 0.0) + now_s - self._last_s
        self._last_s = now_s

    @contextmanager
    def all_booked_to(self, layer: str) -> Iterator[None]:
        """Book every lap inside, and what is left of it at the end, to one layer."""
        self._booked_to = layer
        try:
            yield
        finally:
            self._booked_to = None
            self.lap(layer)
