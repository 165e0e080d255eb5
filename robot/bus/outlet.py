"""What one writer makes of its messages: payload and envelope, numbered from 0."""

from collections.abc import Callable
from itertools import count
from typing import Generic, NamedTuple, TypeVar

import msgspec

from robot.bus.codec import Codec
from robot.bus.envelope import Envelope, check_source, pack

__all__ = ["Outlet", "Wrapped"]

T = TypeVar("T", bound=msgspec.Struct)


class Wrapped(NamedTuple):
    """What is handed to Zenoh."""

    payload: bytes
    attachment: bytes


class Outlet(Generic[T]):
    """Wraps messages of one type.

    Args:
        kind: The type.
        source: Who writes.
        clock: The number of its clock.
        now_ns: That clock.
    """

    def __init__(self, kind: type[T], *, source: str, clock: int, now_ns: Callable[[], int]) -> None:
        self._codec, self._clock, self._now_ns = Codec(kind), clock, now_ns
        self._source = check_source(source)
        self._begun_ns = now_ns()
        self._sequence = count()

    def wrap(self, message: T, *, stamp_ns: int | None = None) -> Wrapped:
        """Return a message with its envelope, stamped now unless it is known better."""
        stamped_ns = self._now_ns() if stamp_ns is None else stamp_ns
        encoded = self._codec.encode(message)
        envelope = Envelope(
            schema=self._codec.schema, clock=self._clock, begun_ns=self._begun_ns, sequence=next(self._sequence),
            stamp_ns=stamped_ns, source=self._source, has_words=encoded.has_words,
        )  # fmt: skip
        return Wrapped(encoded.payload, pack(envelope) + encoded.beside)
