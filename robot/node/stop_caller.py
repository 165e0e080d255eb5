"""Says stop until it is confirmed. Anybody may: it asks for no lease."""

import secrets
from collections.abc import Callable
from threading import Condition
from time import monotonic

from robot.bus.inlet import Received
from robot.bus.session import Bus
from robot.bus.station_rows import StationReport, StopAsk
from robot.bus.topics import REPORT, STOP

__all__ = ["StopCaller"]

AGAIN_S = 0.02


class StopCaller:
    """Stops an arm over the bus.

    Args:
        bus: open.
        by: who says so.
    """

    def __init__(self, bus: Bus, *, by: str) -> None:
        self._by = by
        self._publisher = bus.publisher(STOP)
        self._heard = Condition()
        self._report: StationReport | None = None
        self._subscriber = bus.subscriber(REPORT, self._take)

    @property
    def report(self) -> StationReport | None:
        """What a robot node told last of its station, where it told anything: after a confirmed stop that it stands."""
        return self._report

    def stop(
        self, *, within_s: float, is_final: bool = False, goes_on: Callable[[], bool] = lambda: True
    ) -> float | None:
        """Say stop again and again until a robot node confirms it; return how long that took, None where none did.

        Args:
            within_s: how long it is said at most.
            is_final: nothing is armed any more after it.
            goes_on: asked between two times; it is given up where this says no.

        Raises:
            BusError: the bus is closed.
        """
        number = secrets.randbits(48)
        asked = StopAsk(number=number, by=self._by, is_final=is_final)
        begun_s = monotonic()
        while monotonic() - begun_s < within_s and goes_on():
            self._publisher.put(asked)
            with self._heard:
                if self._heard.wait_for(lambda: self._is_confirmed(number), AGAIN_S):
                    return monotonic() - begun_s
        return None

    def close(self) -> None:
        """Listen no more. Idempotent."""
        self._subscriber.close()

    def _take(self, received: Received[StationReport]) -> None:
        with self._heard:
            self._report = received.message
            self._heard.notify_all()

    def _is_confirmed(self, number: int) -> bool:
        return self._report is not None and number in self._report.stops
