"""Typed ways in and out of the bus. Made by a Bus, which has checked who may."""

from collections.abc import Callable
from typing import Generic, TypeVar

import msgspec
import zenoh
from zenoh import shm

from robot.bus.errors import BusError
from robot.bus.inlet import Counts, Inlet, Received
from robot.bus.link import on_link
from robot.bus.outlet import Outlet
from robot.bus.topic import Congestion, Topic

__all__ = ["Publisher", "Subscriber", "envelope_of"]

T = TypeVar("T", bound=msgspec.Struct)

POOL_BYTES = 1 << 24


class Publisher(Generic[T]):
    """Writes one topic.

    Args:
        session: Of the bus.
        key: Where.
        topic: What.
        outlet: Numbers and wraps the messages.
    """

    def __init__(self, session: zenoh.Session, key: str, topic: Topic[T], outlet: Outlet[T]) -> None:
        self._topic, self._outlet = topic, outlet
        block, drop = zenoh.CongestionControl.BLOCK, zenoh.CongestionControl.DROP
        self._publisher = session.declare_publisher(
            key,
            priority=getattr(zenoh.Priority, topic.priority.name),
            congestion_control=block if topic.congestion is Congestion.BLOCK else drop,
            express=topic.is_express,
        )
        self._pool = shm.ShmProvider.default_backend(POOL_BYTES) if topic.is_shared_memory else None

    @property
    def is_read(self) -> bool:
        """Whether anybody is linked who reads it: what is dear to make need not be made for nobody."""
        try:
            return self._publisher.matching_status.matching  # pyright: ignore[reportAttributeAccessIssue] - its stub lacks it
        except zenoh.ZError:
            return False

    def put(self, message: T, *, stamp_ns: int | None = None) -> None:
        """Write a message, stamped now unless it is known better. One that nobody is linked to read is gone.

        Raises:
            BusError: the bus is closed.
        """
        payload, attachment = self._outlet.wrap(message, stamp_ns=stamp_ns)
        try:
            self._publisher.put(self._placed(payload), attachment=attachment)
        except zenoh.ZError as error:
            raise BusError(f"{self._topic.name}: expected an open bus, got: {error}") from error

    def _placed(self, payload: bytes) -> bytes | shm.ZShmMut:
        """Return the payload in shared memory, where it belongs there and there is room; as it is, otherwise."""
        if self._pool is None or not payload:
            return payload
        try:
            buffer = self._pool.alloc(len(payload), shm.GarbageCollect())
        except zenoh.ZError:
            return payload
        buffer[0 : len(payload)] = payload
        return buffer


class Subscriber(Generic[T]):
    """Reads one topic as long as it is open.

    Args:
        session: Of the bus.
        key: Where.
        inlet: Counts and reads what comes.
        on_message: Called on the bus's own thread with each message; it returns soon and does not write to the bus.
        now_ns: The reader's clock.
    """

    def __init__(
        self, session: zenoh.Session, key: str, inlet: Inlet[T], *, on_message: Callable[[Received[T]], None],
        now_ns: Callable[[], int],
    ) -> None:  # fmt: skip
        self._inlet, self._on_message, self._now_ns = inlet, on_message, now_ns
        self._subscriber = session.declare_subscriber(key, on_link(self._take))

    @property
    def counts(self) -> Counts:
        """What came so far."""
        return self._inlet.counts

    @property
    def error(self) -> BusError | None:
        """What is wrong with the newest that came, None where nothing is."""
        return self._inlet.error

    def close(self) -> None:
        """Read no more. Idempotent."""
        try:
            self._subscriber.undeclare()
        except zenoh.ZError:
            return

    def _take(self, sample: zenoh.Sample) -> None:
        now_ns = self._now_ns()
        received = self._inlet.take(envelope_of(sample.attachment), sample.payload.to_bytes(), now_ns)
        if received is not None:
            self._on_message(received)


def envelope_of(attachment: zenoh.ZBytes | None) -> bytes:
    """Return what came with a message; nothing where nothing did."""
    return b"" if attachment is None else attachment.to_bytes()
