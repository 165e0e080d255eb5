"""A recorder as a listener on the bus: all that a running rig's processes write to each other. The edge.

What comes is handed over on the bus's own thread and written on this one; the bytes are the bus's own, for one codec
makes both. Times are this machine's monotonic clock; a message keeps its source's stamp as its publish time, where
their clocks are one.
"""

from collections.abc import Callable, Iterable
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

from robot.bus import Bus, Received, Topic
from robot.bus.topics import TICKS
from robot.recording.recorder import Recorder
from robot.recording.told_ticks import ToldTicks
from robot.recording.topics import as_on_the_bus

__all__ = ["BusListener"]

Came = tuple[Topic[Any], Received[Any]]


class BusListener:
    """Hands what is written to some topics to a recorder.

    Args:
        bus: open.
        recorder: takes it.
        topics: what is listened to.
        ticks: takes every tick of an arm on a wire; they go into the recorder if left out.

    Attributes:
        n: Messages recorded.
    """

    def __init__(
        self, bus: Bus, recorder: Recorder, topics: Iterable[Topic[Any]], *, ticks: ToldTicks | None = None
    ) -> None:
        self._recorder, self._ticks = recorder, ticks or ToldTicks(recorder)
        self._came: SimpleQueue[Came] = SimpleQueue()
        self._newest_ns = self.n = 0
        self._subscribers = [bus.subscriber(topic, partial(self._take, as_on_the_bus(topic))) for topic in topics]

    def run(self, should_stop: Callable[[], bool], *, poll_s: float = 0.1) -> None:
        """Record until a stop is asked for, and then what has come by then."""
        while not should_stop():
            self._write(poll_s)
        for subscriber in self._subscribers:
            subscriber.close()
        while not self._came.empty():
            self._write(0.0)

    def lost(self) -> int:
        """Return how many messages were written and never came."""
        return sum(subscriber.counts.lost for subscriber in self._subscribers)

    def refused(self) -> int:
        """Return how many came that are none of their topic's type."""
        return sum(s.counts.malformed + s.counts.other_schema for s in self._subscribers)

    def _take(self, topic: Topic[Any], received: Received[Any]) -> None:
        self._came.put((topic, received))

    def _write(self, timeout_s: float) -> None:
        try:
            topic, received = self._came.get(timeout=timeout_s) if timeout_s else self._came.get_nowait()
        except Empty:
            return
        self._newest_ns = max(self._newest_ns, received.arrived_ns)
        if topic.name == TICKS.name:
            self.n += self._ticks.take_batch(received)
            return
        topic = self._ticks.named(topic, received.message)
        self._recorder.write(topic, received.message, log_ns=self._newest_ns, stamp_ns=max(0, received.stamp_ns))
        self.n += 1
