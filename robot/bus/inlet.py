"""What one reader makes of what comes under one topic: messages, and counts of all that was wrong."""

from collections import OrderedDict
from typing import Generic, TypeVar

import msgspec

from robot.bus.codec import Codec
from robot.bus.envelope import ENVELOPE_BYTES, HEAD_BYTES, Envelope, Origin, unpack_head, unpack_tail
from robot.bus.errors import MalformedError, SchemaError
from robot.bus.sequence import Arrival, SequenceWindow
from robot.bus.topic import Keep, Topic

__all__ = ["MAX_STREAMS", "Counts", "Inlet", "Received"]

T = TypeVar("T", bound=msgspec.Struct)
MAX_STREAMS = 64
"""So many sources' numbers are remembered at once."""


class Counts(msgspec.Struct, frozen=True, kw_only=True):
    """What came under one topic since it is read."""

    received: int = 0
    """All that came, whatever it was."""
    taken: int = 0
    """Handed on."""
    lost: int = 0
    """Written between the first and the newest that came, and not come so far."""
    duplicated: int = 0
    reordered: int = 0
    late: int = 0
    """Older than the topic's deadline; judged only where reader and source have the same clock."""
    other_schema: int = 0
    malformed: int = 0
    restarts: int = 0
    """How often a source that had been heard began anew."""


class Received(msgspec.Struct, Generic[T], frozen=True, kw_only=True):
    """A message with what its envelope says."""

    message: T
    envelope: Envelope
    arrived_ns: int
    """By the reader's clock."""
    age_ns: int | None
    """None where the source's clock is another than the reader's."""

    @property
    def stamp_ns(self) -> int:
        """The source's stamp by the reader's clock; the arrival, where their clocks are two."""
        return self.arrived_ns if self.age_ns is None else self.envelope.stamp_ns


class _Stream:
    """What one source wrote since it began."""

    def __init__(self, origin: Origin) -> None:
        self.origin, self.window = origin, SequenceWindow()


class Inlet(Generic[T]):
    """Reads one topic. Nothing that comes can raise: it is counted, and told in words.

    Args:
        topic: What is read.
        reader: Who reads, for the words.
        clock: The number of the reader's clock.

    Attributes:
        error: What is wrong with the newest that came, None where nothing is.
    """

    def __init__(self, topic: Topic[T], *, reader: str, clock: int) -> None:
        self._topic, self._reader, self._clock = topic, reader, clock
        self._codec = Codec(topic.kind)
        self._streams: OrderedDict[bytes, _Stream] = OrderedDict()
        self._current: dict[str, _Stream] = {}
        self._n = dict.fromkeys(Counts.__struct_fields__, 0)
        self._n_lost_before = 0
        self.error: SchemaError | MalformedError | None = None

    @property
    def counts(self) -> Counts:
        """What came so far."""
        n_lost = self._n_lost_before + sum(stream.window.n_lost for stream in list(self._streams.values()))
        return Counts(**(self._n | {"lost": n_lost}))

    def take(self, attachment: bytes, payload: bytes, now_ns: int) -> Received[T] | None:
        """Count what came, and return it where it is to be handed on."""
        self._n["received"] += 1
        try:
            stream = self._streams.get(attachment[:HEAD_BYTES]) or self._begin(attachment)
            envelope = unpack_tail(attachment, stream.origin)
            if not self._is_due(stream, envelope.sequence):
                return None
            self._codec.check_schema(stream.origin, name=self._topic.name, reader=self._reader)
            message = self._codec.decode(payload, attachment[ENVELOPE_BYTES:], has_words=envelope.has_words)
        except SchemaError as error:
            self._n["other_schema"] += 1
            self.error = error
            return None
        except MalformedError as error:
            self._n["malformed"] += 1
            self.error = MalformedError(f"{self._topic.name}: {error}")
            return None
        self.error = None
        self._n["taken"] += 1
        age_ns = now_ns - envelope.stamp_ns if stream.origin.clock == self._clock else None
        deadline_s = self._topic.deadline_s
        if age_ns is not None and deadline_s is not None and age_ns > deadline_s * 1e9:
            self._n["late"] += 1
        return Received(message=message, envelope=envelope, arrived_ns=now_ns, age_ns=age_ns)

    def _is_due(self, stream: _Stream, sequence: int) -> bool:
        """Count by the numbers, and tell whether the topic wants such a message."""
        arrival = stream.window.note(sequence)
        if arrival is Arrival.DUPLICATE:
            self._n["duplicated"] += 1
            return False
        if arrival is Arrival.REORDERED or self._current[stream.origin.source] is not stream:
            self._n["reordered"] += 1
            return self._topic.keep is Keep.ALL
        return True

    def _begin(self, attachment: bytes) -> _Stream:
        """Remember a stream that is new; it takes the place of its source's last.

        Raises:
            MalformedError: it has no envelope of ours.
        """
        stream = _Stream(unpack_head(attachment))
        unpack_tail(attachment, stream.origin)  # before it takes anybody's place
        source = stream.origin.source
        self._n["restarts"] += source in self._current
        self._current[source] = self._streams[attachment[:HEAD_BYTES]] = stream
        if len(self._streams) > MAX_STREAMS:
            _, oldest = self._streams.popitem(last=False)
            self._n_lost_before += oldest.window.n_lost
            if self._current[oldest.origin.source] is oldest:
                del self._current[oldest.origin.source]
        return stream
