"""What one writer makes of its messages: payload and envelope, numbered from 0."""

from collections.abc import Callable
from itertools import count
from typing import Generic, NamedTuple, TypeVar

import msgspec

from robot.bus.codec import Codec
from robot.bus.envelope import Origin, check_source, pack_head, pack_tail

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
        self._codec, self._now_ns = Codec(kind), now_ns
        self._head = pack_head(
            Origin(schema=self._codec.schema, clock=clock, begun_ns=now_ns(), source=check_source(source))
        )
        self._sequence = count()

    def wrap(self, message: T, *, stamp_ns: int | None = None) -> Wrapped:
        """Return a message with its envelope, stamped now unless it is known better."""
        stamped_ns = self._now_ns() if stamp_ns is None else stamp_ns
        payload, beside, has_words = self._codec.encode(message)
        tail = pack_tail(next(self._sequence), stamped_ns, has_words=has_words)
        return Wrapped(payload, self._head + tail + beside)
