"""The newest message of a topic, and how old it is."""

from collections.abc import Callable
from threading import Condition
from time import monotonic_ns
from typing import Generic, TypeVar

import msgspec

from robot.bus.inlet import Counts, Received
from robot.bus.session import Bus
from robot.bus.topic import Topic
from robot.errors import StaleStateError

__all__ = ["Latest"]

T = TypeVar("T", bound=msgspec.Struct)

FIRST_S = 5.0


class Latest(Generic[T]):
    """Keeps the newest message of a topic with a deadline.

    Args:
        bus: Open.
        topic: What is read.
        writes: Which process to look for where nothing comes, for the words.
        now_ns: The reader's clock.
    """

    def __init__(
        self, bus: Bus, topic: Topic[T], *, writes: str, now_ns: Callable[[], int] = monotonic_ns
    ) -> None:  # fmt: skip
        assert topic.deadline_s is not None, f"{topic.name}: has no deadline"
        self._name, self._deadline_ns, self._writes = topic.name, round(topic.deadline_s * 1e9), writes
        self._now_ns = now_ns
        self._newest: Received[T] | None = None
        self._arrival = Condition()
        self._n_arrived = 0
        self._subscriber = bus.subscriber(topic, self._take_in)

    @property
    def counts(self) -> Counts:
        """What came so far."""
        return self._subscriber.counts

    def wait_next(self, n: int = 2) -> None:
        """Wait for so many messages from now on, so that the newest tells of what holds now.

        Raises:
            StaleStateError: they do not come within 5 s.
            BusError: what came was no message of this topic.
        """
        with self._arrival:
            wanted = self._n_arrived + n
            if not self._arrival.wait_for(lambda: self._n_arrived >= wanted, FIRST_S):
                raise self._missing(f"a message within {FIRST_S:g} s, none came")

    def read(self) -> Received[T]:
        """Return the newest message.

        Raises:
            StaleStateError: it is older than the topic's deadline, or there is none.
            BusError: what came was no message of this topic.
        """
        newest, limit_ms = self._newest, self._deadline_ns / 1e6
        if newest is None:
            raise self._missing(f"a message not older than {limit_ms:g} ms, none came yet")
        age_ns = self._now_ns() - newest.stamp_ns
        if age_ns > self._deadline_ns:
            raise self._missing(f"a message not older than {limit_ms:g} ms, the newest is {age_ns / 1e6:.0f} ms old")
        return newest

    def close(self) -> None:
        """Read no more. Idempotent."""
        self._subscriber.close()

    def _take_in(self, received: Received[T]) -> None:
        with self._arrival:
            self._newest = received
            self._n_arrived += 1
            self._arrival.notify_all()

    def _missing(self, what: str) -> Exception:
        """Return the error of a message that is not there: what came instead, where that is why."""
        wrong = self._subscriber.error
        if wrong is not None:
            return type(wrong)(*wrong.args)
        return StaleStateError(f"{self._name}: expected {what}; does {self._writes} run?")
