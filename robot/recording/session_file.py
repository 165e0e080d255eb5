"""A recorded session, opened for reading by its summary: only what is asked for is read and unpacked.

A file without its end is refused in words: `autotelic session recover` gives it one.
"""

import mmap
from collections.abc import Collection, Iterator
from heapq import heappop, heappush
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeVar
from zlib import crc32

import msgspec

from robot.bus.codec import Codec, schema_hash
from robot.bus.topic import Topic
from robot.recording.compression import unpack_chunk
from robot.recording.errors import DamagedError, UnfitError
from robot.recording.recorder import SCHEMA, WORDS
from robot.recording.records import (
    HEAD_BYTES,
    MAGIC,
    AttachedRecord,
    AttachmentIndexed,
    ChannelRecord,
    ChunkIndexed,
    ChunkRecord,
    Cursor,
    FooterRecord,
    MetadataIndexed,
    MetadataRecord,
    Op,
    SchemaRecord,
    Statistics,
    messages_of,
)

__all__ = ["Raw", "SessionFile"]

T = TypeVar("T", bound=msgspec.Struct)
_FOOTER_BYTES = HEAD_BYTES + 20


class Raw(NamedTuple):
    """A message as it lies in the file."""

    channel: int
    sequence: int
    log_ns: int
    publish_ns: int
    payload: bytes


class SessionFile:
    """One MCAP file. Use it as a context, or close it.

    Args:
        path: of the file.

    Raises:
        UnfitError: there is no such file, or it is none of this kind.
        DamagedError: it is torn or was changed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with path.open("rb") as opened:
                self.size = path.stat().st_size
                if self.size < len(MAGIC):
                    raise DamagedError(f"{path}: expected an MCAP file, it has {self.size} bytes")
                self._map = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            message = f"{path}: expected a session's file, {(error.strerror or str(error)).lower()}"
            raise UnfitError(message) from error
        self.schemas: dict[int, SchemaRecord] = {}
        self.channels: dict[int, ChannelRecord] = {}
        self.chunks: list[ChunkIndexed] = []
        self._attached: list[AttachmentIndexed] = []
        self._metadata: list[MetadataIndexed] = []
        self.statistics: Statistics | None = None
        try:
            self._read_summary()
        except DamagedError as error:
            self.close()
            raise DamagedError(
                f"{path}: {error}; `autotelic session recover {path}` saves what is whole in it"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the file. Idempotent."""
        self._map.close()

    @property
    def about(self) -> dict[str, str]:
        """What the session says of itself; empty in a file of somebody else's."""
        return self.metadata().get("session", {})

    def metadata(self) -> dict[str, dict[str, str]]:
        """Return tables of texts by their names; of several of one name, as in what was merged, the first."""
        found = (MetadataRecord.read(self._cursor(m.at, m.length, Op.METADATA)) for m in reversed(self._metadata))
        return {record.name: record.values for record in found}

    def attachments(self) -> tuple[AttachmentIndexed, ...]:
        """Return what is attached, without its content."""
        return tuple(self._attached)

    def attachment(self, name: str) -> bytes | None:
        """Return an attached file's content, None where there is none of that name.

        Raises:
            DamagedError: its checksum is another.
        """
        for indexed in self._attached:
            if indexed.name == name:
                return AttachedRecord.read(self._cursor(indexed.at, indexed.length, Op.ATTACHMENT)).content
        return None

    def topic_of(self, channel: int) -> str:
        """Return a channel's topic."""
        return self.channels[channel].topic

    def raw(self, topics: Collection[str] | None = None) -> Iterator[Raw]:
        """Yield messages by their log times, of equal ones as they were written; of some topics, or of all.

        Raises:
            DamagedError: a chunk of theirs is not whole.
        """
        wanted = {n for n, channel in self.channels.items() if topics is None or channel.topic in topics}
        pending = sorted((c for c in self.chunks if wanted & c.index_at.keys()), key=lambda c: (c.start_ns, c.at))
        heap: list[tuple[int, int, int, Raw]] = []
        for i, chunk in enumerate(pending):
            for order, found in enumerate(messages_of(self._records(chunk))):
                if found[0] in wanted:
                    heappush(heap, (found[2], chunk.at, order, Raw(*found)))
            until_ns = pending[i + 1].start_ns if i + 1 < len(pending) else None
            while heap and (until_ns is None or heap[0][0] < until_ns):
                yield heappop(heap)[3]

    def messages(self, *topics: Topic[Any]) -> Iterator[tuple[Topic[Any], Raw, Any]]:
        """Yield messages of some topics, decoded, by their log times.

        Raises:
            DamagedError: one of them is none of its type.
            UnfitError: they were written with another version's type.
        """
        by_name = {topic.name: (topic, Codec(topic.kind, is_whole=True)) for topic in topics}
        by_channel = {
            n: (*by_name[c.topic], WORDS in c.metadata) for n, c in self.channels.items() if c.topic in by_name
        }
        for raw in self.raw(by_name):
            topic, codec, has_words = by_channel[raw.channel]
            try:
                yield topic, raw, codec.decode(raw.payload, b"", has_words=has_words)
            except ValueError as error:
                where = f"{self.path}: {topic.name} at {raw.log_ns} ns: {error}"
                if self.is_drifted(raw.channel, topic):
                    raise UnfitError(f"{where}; it was recorded by a version with another type") from error
                raise DamagedError(where) from error

    def is_drifted(self, channel: int, topic: Topic[Any]) -> bool:
        """Whether a channel was written with a type that is another here."""
        return self.channels[channel].metadata.get(SCHEMA) != schema_hash(topic.kind).hex()

    def _records(self, chunk: ChunkIndexed) -> bytes:
        try:
            return unpack_chunk(ChunkRecord.read(self._cursor(chunk.at, chunk.length, Op.CHUNK)))
        except DamagedError as error:
            raise DamagedError(
                f"{self.path}: {error}, at byte {chunk.at}; `autotelic session recover` leaves it out"
            ) from error

    def _cursor(self, at: int, length: int, op: Op) -> Cursor:
        if at + length > self.size or length < HEAD_BYTES or self._map[at] != op:
            raise DamagedError(f"expected a record of kind {op.name.lower()} at byte {at}, there is none")
        return Cursor(self._map[at + HEAD_BYTES : at + length])

    def _read_summary(self) -> None:
        size, tail = self.size, len(MAGIC)
        if self._map[:tail] != MAGIC:
            raise DamagedError("expected an MCAP file, it does not begin like one")
        if size < 2 * tail + _FOOTER_BYTES or self._map[size - tail :] != MAGIC:
            raise DamagedError("expected a whole MCAP file, it breaks off")
        footer_at = size - tail - _FOOTER_BYTES
        footer = FooterRecord.read(self._cursor(footer_at, _FOOTER_BYTES, Op.FOOTER))
        if not 0 < footer.summary_at <= footer_at:
            raise DamagedError(f"expected a summary before byte {footer_at}, it is said to be at {footer.summary_at}")
        if footer.crc and crc32(self._map[footer.summary_at : size - tail - 4]) != footer.crc:
            raise DamagedError("the summary's checksum is another: it was changed")
        self._take_in(Cursor(self._map[footer.summary_at : footer_at]))

    def _take_in(self, cursor: Cursor) -> None:
        while not cursor.is_done:
            op, length = cursor.whole(1), cursor.whole(8)
            body = Cursor(cursor.take(length))
            if op == Op.SCHEMA:
                schema = SchemaRecord.read(body)
                self.schemas[schema.id] = schema
            elif op == Op.CHANNEL:
                channel = ChannelRecord.read(body)
                self.channels[channel.id] = channel
            elif op == Op.CHUNK_INDEX:
                self.chunks.append(ChunkIndexed.read(body))
            elif op == Op.ATTACHMENT_INDEX:
                self._attached.append(AttachmentIndexed.read(body))
            elif op == Op.METADATA_INDEX:
                self._metadata.append(MetadataIndexed.read(body))
            elif op == Op.STATISTICS:
                self.statistics = Statistics.read(body)
