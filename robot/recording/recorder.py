"""A recorder: messages of the topics become chunks of one MCAP file. It holds no clock: who hands a message tells when.

Topics of a kind share chunks (`Lane`), so that who needs decisions alone need not unpack what came every tick.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, Protocol

import msgspec

from robot.bus.codec import Codec, schema_hash
from robot.bus.topic import Topic
from robot.recording.chunks import Chunks
from robot.recording.lanes import Lane
from robot.recording.mcap_file import Index
from robot.recording.records import AttachedRecord, ChannelRecord, MetadataRecord, SchemaRecord
from robot.recording.sink import Sink

__all__ = ["SCHEMA", "WORDS", "Keeps", "Recorder", "schema_record"]

SCHEMA, WORDS = "schema", "words"
"""Keys of a channel's metadata: the hash of its type as the bus has it, and whether its messages have numbers that are
not finite in words (robot.bus.codec)."""


class Keeps(Protocol):
    """Hears of every message: a flight recorder."""

    def heard(self, topic: Topic[Any], payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool) -> None:
        """Take note of a message."""
        ...

    def look(self, message: object, *, log_ns: int) -> None:
        """Look at what it says, where that is known."""
        ...


class _Channel:
    """One topic's messages on their way."""

    def __init__(self, number: int, lane: Lane) -> None:
        self.number, self.lane, self.n = number, lane, 0


class Recorder:
    """Encodes messages and gathers them into chunks.

    Args:
        sink: where chunks go.
        tell: is told once in words when something is lost.
        lanes: which topics share chunks, by a topic's name; DECISIONS where it is not named.
        keeps: hears of every message, too.
        unkept: names of topics whose messages it is not told: it hears of them elsewhere.

    Attributes:
        n_lost: Messages that the disk was too slow for, or gone.
    """

    def __init__(
        self, sink: Sink, *, lanes: Mapping[str, Lane], tell: Callable[[str], object] = lambda _: None,
        keeps: "Keeps | None" = None, unkept: Collection[str] = (),
    ) -> None:  # fmt: skip
        self._unkept = frozenset(unkept)
        self._sink, self._tell, self._lane_of, self._keeps = sink, tell, lanes, keeps
        self._chunks = Chunks(self._hand_over)
        self._channels: dict[tuple[str, bool], _Channel] = {}
        """By topic, and whether numbers are in words."""
        self._codecs: dict[type, Codec[Any]] = {}
        self._schemas: dict[type, int] = {}
        self._encode = msgspec.json.Encoder().encode
        self._is_told = False
        self.n_lost = 0

    def prepare(self, topics: Iterable[Topic[Any]]) -> None:
        """Write which topics there may be, so that none is opened while a tick waits."""
        for topic in topics:
            self._open(topic, has_words=False)

    def attach(self, name: str, media_type: str, content: bytes) -> None:
        """Put a file into the file."""
        self._sink.put_surely(lambda file: file.add_attachment(AttachedRecord(0, 0, name, media_type, content)))

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Put a table of texts into the file."""
        kept = MetadataRecord(name, dict(values))
        self._sink.put_surely(lambda file: file.add_metadata(kept))

    def write(self, topic: Topic[Any], message: msgspec.Struct, *, log_ns: int, stamp_ns: int | None = None) -> bytes:
        """Record a message, and return its payload.

        Args:
            topic: which.
            message: of the topic's kind.
            log_ns: when it was, by the session's clock.
            stamp_ns: what the message itself says; the same where it says nothing.
        """
        payload, _, has_words = self._codec(topic.kind).encode(message)
        self.put(topic, payload, log_ns=log_ns, stamp_ns=log_ns if stamp_ns is None else stamp_ns, has_words=has_words)
        if self._keeps is not None:
            self._keeps.look(message, log_ns=log_ns)
        return payload

    def encoded(self, message: msgspec.Struct) -> bytes:
        """Return the payload of a message whose numbers are known to be finite, as those are that passed the gate."""
        return self._encode(message)

    def put(self, topic: Topic[Any], payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool = False) -> None:
        """Record a message as its bytes."""
        channel = self._channels.get((topic.name, has_words)) or self._open(topic, has_words=has_words)
        self._chunks.add(channel.lane, channel.number, channel.n, log_ns, stamp_ns, payload)
        channel.n += 1
        if self._keeps is not None and topic.name not in self._unkept:
            self._keeps.heard(topic, payload, log_ns=log_ns, stamp_ns=stamp_ns, has_words=has_words)

    def flush(self, when_written: Callable[[], object] | None = None) -> None:
        """Hand over what waits, however little.

        Args:
            when_written: called on the writing thread once it is in the file; never, where something was left out.
        """
        n_lost = self.n_lost
        self._chunks.flush()
        if when_written is not None and self.n_lost == n_lost:
            self._sink.put(lambda _file: when_written())

    def close(self) -> None:
        """Finish the file. Idempotent."""
        self.flush()
        self._sink.close()
        self._say_if_lost()

    def _hand_over(self, records: bytes, index: Index, n: int) -> None:
        if not self._sink.put(lambda file: file.add_chunk(records, index)):
            self.n_lost += n
        self._say_if_lost()

    def _say_if_lost(self) -> None:
        why = self._sink.why_lost
        if self._is_told or (why is None and not self.n_lost):
            return
        self._is_told = True
        self._tell(why or f"{self._sink.path}: the disk is too slow: messages are left out, and nothing waits for it")

    def _open(self, topic: Topic[Any], *, has_words: bool) -> _Channel:
        number = len(self._channels) + 1
        about = {SCHEMA: schema_hash(topic.kind).hex()} | ({WORDS: "yes"} if has_words else {})
        record = ChannelRecord(number, self._schema(topic.kind), topic.name, "json", about)
        self._sink.put_surely(lambda file: file.add_channel(record))
        channel = _Channel(number, self._lane_of.get(topic.name, Lane.DECISIONS))
        self._channels[topic.name, has_words] = channel
        return channel

    def _schema(self, kind: type[msgspec.Struct]) -> int:
        number = self._schemas.get(kind)
        if number is None:
            number = self._schemas[kind] = len(self._schemas) + 1
            record = schema_record(number, kind)
            self._sink.put_surely(lambda file: file.add_schema(record))
        return number

    def _codec(self, kind: type[msgspec.Struct]) -> Codec[Any]:
        codec = self._codecs.get(kind)
        if codec is None:
            codec = self._codecs[kind] = Codec(kind, is_whole=True)
        return codec


def schema_record(number: int, kind: type[msgspec.Struct]) -> SchemaRecord:
    """Return what messages of a kind look like, as JSON schema; Foxglove's kinds bear Foxglove's names."""
    definition = msgspec.json.encode(_rooted(msgspec.json.schema(kind)), order="deterministic")
    return SchemaRecord(number, getattr(kind, "SCHEMA_NAME", f"autotelic.{kind.__name__}"), "jsonschema", definition)


def _rooted(schema: dict[str, Any]) -> dict[str, Any]:
    """Return a schema that is an object itself, as viewers want it, and not a reference to one."""
    parts = schema.get("$defs", {})
    root = parts.get(schema.get("$ref", "").rpartition("/")[2])
    return schema if root is None else {**root, "$defs": parts}
