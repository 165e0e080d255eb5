"""The records of an MCAP file as bytes, written and read. Pure; the format is MCAP's version 0.

A record is one byte that says what it is, eight that say how long it is, and its body; numbers are little-endian. Here
the format is written out, and not left to the mcap package, because that writes one chunk at a time and gives up at the
first byte that is wrong; it stands beside as the independent reader in the tests.
"""

from collections.abc import Iterator, Mapping
from enum import IntEnum
from struct import Struct as Form
from struct import pack
from typing import NamedTuple
from zlib import crc32

from robot.recording.errors import DamagedError

__all__ = [
    "HEAD_BYTES", "MAGIC", "MESSAGE_HEAD", "AttachedRecord", "AttachmentIndexed", "ChannelRecord", "ChunkIndexed",
    "ChunkRecord", "Cursor", "FooterRecord", "MetadataIndexed", "MetadataRecord", "Op", "SchemaRecord", "Statistics",
    "messages_of", "parts_of", "record", "strings", "text",
]  # fmt: skip

MAGIC = b"\x89MCAP0\r\n"
_HEAD = Form("<BQ")
HEAD_BYTES = _HEAD.size
MESSAGE_HEAD = Form("<BQHIQQ")
"""Of a message's record: what it is, length, channel, how many-th there, log time, publish time."""
_BODY_HEAD = 22


class Op(IntEnum):
    """What a record is."""

    HEADER = 1
    FOOTER = 2
    SCHEMA = 3
    CHANNEL = 4
    MESSAGE = 5
    CHUNK = 6
    MESSAGE_INDEX = 7
    CHUNK_INDEX = 8
    ATTACHMENT = 9
    ATTACHMENT_INDEX = 10
    STATISTICS = 11
    METADATA = 12
    METADATA_INDEX = 13
    SUMMARY_OFFSET = 14
    DATA_END = 15


def record(op: Op, body: bytes) -> bytes:
    """Return a record."""
    return _HEAD.pack(op, len(body)) + body


def text(value: str) -> bytes:
    """Return a text with its length before it."""
    raw = value.encode()
    return pack("<I", len(raw)) + raw


def strings(values: Mapping[str, str]) -> bytes:
    """Return a table of texts, its length in bytes before it."""
    raw = b"".join(text(key) + text(value) for key, value in values.items())
    return pack("<I", len(raw)) + raw


class Cursor:
    """Reads a record's body from its beginning on.

    Raises:
        DamagedError: whatever is read reaches beyond its end, or a text is none.
    """

    def __init__(self, raw: bytes | memoryview, at: int = 0, end: int | None = None) -> None:
        self.raw, self.at = raw, at
        self.end = len(raw) if end is None else end

    @property
    def is_done(self) -> bool:
        """Whether nothing is left."""
        return self.at >= self.end

    def take(self, n: int) -> bytes:
        """Return so many bytes."""
        if n > self.end - self.at:
            raise DamagedError(f"expected {n} bytes more, {self.end - self.at} are left")
        self.at += n
        return bytes(self.raw[self.at - n : self.at])

    def whole(self, n: int) -> int:
        """Return a whole number of n bytes."""
        return int.from_bytes(self.take(n), "little")

    def text(self) -> str:
        """Return a text."""
        raw = self.take(self.whole(4))
        try:
            return raw.decode()
        except UnicodeDecodeError as error:
            raise DamagedError(f"expected a text, got {raw[:20]!r}") from error

    def strings(self) -> dict[str, str]:
        """Return a table of texts."""
        inner = self._part(self.whole(4))
        found: dict[str, str] = {}
        while not inner.is_done:
            key = inner.text()
            found[key] = inner.text()
        return found

    def pairs(self, first: int, second: int) -> list[tuple[int, int]]:
        """Return a table of whole numbers of so many bytes each."""
        inner = self._part(self.whole(4))
        found: list[tuple[int, int]] = []
        while not inner.is_done:
            a = inner.whole(first)
            found.append((a, inner.whole(second)))
        return found

    def _part(self, n: int) -> "Cursor":
        if n > self.end - self.at:
            raise DamagedError(f"expected {n} bytes more, {self.end - self.at} are left")
        self.at += n
        return Cursor(self.raw, self.at - n, self.at)


class SchemaRecord(NamedTuple):
    """What messages of some channels look like."""

    id: int
    name: str
    encoding: str
    definition: bytes

    def bytes(self) -> bytes:
        """Return it as a record."""
        body = pack("<H", self.id) + text(self.name) + text(self.encoding) + pack("<I", len(self.definition))
        return record(Op.SCHEMA, body + self.definition)

    @staticmethod
    def read(c: Cursor) -> "SchemaRecord":
        """Return it from its body."""
        return SchemaRecord(c.whole(2), c.text(), c.text(), c.take(c.whole(4)))


class ChannelRecord(NamedTuple):
    """One stream of messages."""

    id: int
    schema: int
    topic: str
    encoding: str
    metadata: dict[str, str]

    def bytes(self) -> bytes:
        """Return it as a record."""
        return record(
            Op.CHANNEL,
            pack("<HH", self.id, self.schema) + text(self.topic) + text(self.encoding) + strings(self.metadata),
        )

    @staticmethod
    def read(c: Cursor) -> "ChannelRecord":
        """Return it from its body."""
        return ChannelRecord(c.whole(2), c.whole(2), c.text(), c.text(), c.strings())


class ChunkRecord(NamedTuple):
    """Messages, compressed."""

    start_ns: int
    end_ns: int
    size: int
    """Uncompressed."""
    crc: int
    compression: str
    packed: bytes

    def bytes(self) -> bytes:
        """Return it as a record."""
        head = pack("<QQQI", self.start_ns, self.end_ns, self.size, self.crc)
        return record(Op.CHUNK, head + text(self.compression) + pack("<Q", len(self.packed)) + self.packed)

    @staticmethod
    def read(c: Cursor) -> "ChunkRecord":
        """Return it from its body."""
        return ChunkRecord(c.whole(8), c.whole(8), c.whole(8), c.whole(4), c.text(), c.take(c.whole(8)))


class ChunkIndexed(NamedTuple):
    """Where a chunk lies, and which channels are in it."""

    start_ns: int
    end_ns: int
    at: int
    length: int
    index_at: dict[int, int]
    index_length: int
    compression: str
    packed_size: int
    size: int

    def bytes(self) -> bytes:
        """Return it as a record."""
        pairs = b"".join(pack("<HQ", channel, at) for channel, at in self.index_at.items())
        body = pack("<QQQQI", self.start_ns, self.end_ns, self.at, self.length, len(pairs)) + pairs
        body += pack("<Q", self.index_length) + text(self.compression) + pack("<QQ", self.packed_size, self.size)
        return record(Op.CHUNK_INDEX, body)

    @staticmethod
    def read(c: Cursor) -> "ChunkIndexed":
        """Return it from its body."""
        return ChunkIndexed(
            c.whole(8), c.whole(8), c.whole(8), c.whole(8), dict(c.pairs(2, 8)), c.whole(8), c.text(), c.whole(8),
            c.whole(8),
        )  # fmt: skip


class AttachedRecord(NamedTuple):
    """A file inside the file; its own checksum has been verified when it was read."""

    log_ns: int
    create_ns: int
    name: str
    media_type: str
    content: bytes

    def bytes(self) -> bytes:
        """Return it as a record."""
        body = pack("<QQ", self.log_ns, self.create_ns) + text(self.name) + text(self.media_type)
        body += pack("<Q", len(self.content)) + self.content
        return record(Op.ATTACHMENT, body + pack("<I", crc32(body)))

    @staticmethod
    def read(c: Cursor) -> "AttachedRecord":
        """Return it from its body."""
        begin = c.at
        found = AttachedRecord(c.whole(8), c.whole(8), c.text(), c.text(), c.take(c.whole(8)))
        expected = crc32(c.raw[begin : c.at])
        crc = c.whole(4)
        if crc not in (0, expected):
            raise DamagedError(f"attachment {found.name}: expected checksum {expected:08x}, got {crc:08x}")
        return found


class AttachmentIndexed(NamedTuple):
    """Where an attachment lies."""

    at: int
    length: int
    log_ns: int
    create_ns: int
    size: int
    name: str
    media_type: str

    def bytes(self) -> bytes:
        """Return it as a record."""
        body = pack("<QQQQQ", self.at, self.length, self.log_ns, self.create_ns, self.size)
        return record(Op.ATTACHMENT_INDEX, body + text(self.name) + text(self.media_type))

    @staticmethod
    def read(c: Cursor) -> "AttachmentIndexed":
        """Return it from its body."""
        return AttachmentIndexed(
            c.whole(8), c.whole(8), c.whole(8), c.whole(8), c.whole(8), c.text(), c.text()
        )  # fmt: skip


class MetadataRecord(NamedTuple):
    """A table of texts under a name."""

    name: str
    values: dict[str, str]

    def bytes(self) -> bytes:
        """Return it as a record."""
        return record(Op.METADATA, text(self.name) + strings(self.values))

    @staticmethod
    def read(c: Cursor) -> "MetadataRecord":
        """Return it from its body."""
        return MetadataRecord(c.text(), c.strings())


class MetadataIndexed(NamedTuple):
    """Where metadata lies."""

    at: int
    length: int
    name: str

    def bytes(self) -> bytes:
        """Return it as a record."""
        return record(Op.METADATA_INDEX, pack("<QQ", self.at, self.length) + text(self.name))

    @staticmethod
    def read(c: Cursor) -> "MetadataIndexed":
        """Return it from its body."""
        return MetadataIndexed(c.whole(8), c.whole(8), c.text())


class Statistics(NamedTuple):
    """How much a file holds."""

    n_messages: int
    n_schemas: int
    n_channels: int
    n_attachments: int
    n_metadata: int
    n_chunks: int
    start_ns: int
    end_ns: int
    n_by_channel: dict[int, int]

    def bytes(self) -> bytes:
        """Return it as a record."""
        pairs = b"".join(pack("<HQ", channel, n) for channel, n in self.n_by_channel.items())
        counts = (self.n_messages, self.n_schemas, self.n_channels, self.n_attachments, self.n_metadata, self.n_chunks)
        body = pack("<QHIIIIQQ", *counts, self.start_ns, self.end_ns) + pack("<I", len(pairs)) + pairs
        return record(Op.STATISTICS, body)

    @staticmethod
    def read(c: Cursor) -> "Statistics":
        """Return it from its body."""
        counts = (c.whole(8), c.whole(2), c.whole(4), c.whole(4), c.whole(4), c.whole(4))
        return Statistics(*counts, c.whole(8), c.whole(8), dict(c.pairs(2, 8)))


class FooterRecord(NamedTuple):
    """The last record: where the summary begins."""

    summary_at: int
    offsets_at: int
    crc: int

    def bytes(self) -> bytes:
        """Return it as a record."""
        return record(Op.FOOTER, pack("<QQI", *self))

    @staticmethod
    def read(c: Cursor) -> "FooterRecord":
        """Return it from its body."""
        return FooterRecord(c.whole(8), c.whole(8), c.whole(4))


def parts_of(raw: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield of every record of a chunk what it is, and where its body begins and ends.

    Raises:
        DamagedError: a record reaches beyond the end.
    """
    at, end = 0, len(raw)
    while at < end:
        if end - at < HEAD_BYTES:
            raise DamagedError(f"expected a record in a chunk, {end - at} bytes are left")
        op, length = _HEAD.unpack_from(raw, at)
        begin = at + HEAD_BYTES
        at = begin + length
        if at > end or (op == Op.MESSAGE and length < _BODY_HEAD):
            raise DamagedError(f"a record of {length} bytes in a chunk: expected one that ends within it")
        yield op, begin, at


def messages_of(raw: bytes) -> Iterator[tuple[int, int, int, int, bytes]]:
    """Yield channel, how many-th, log time, publish time and payload of every message in a chunk's records.

    Raises:
        DamagedError: a record reaches beyond the end.
    """
    head = MESSAGE_HEAD.unpack_from
    for op, begin, after in parts_of(raw):
        if op == Op.MESSAGE:
            _, _, channel, sequence, log_ns, publish_ns = head(raw, begin - HEAD_BYTES)
            yield channel, sequence, log_ns, publish_ns, raw[begin + _BODY_HEAD : after]
