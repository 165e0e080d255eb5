"""An MCAP file in the making: what was written where, so that its end can tell it."""

from collections.abc import Callable
from struct import pack
from zlib import crc32

from robot.recording.compression import pack_chunk
from robot.recording.records import (
    MAGIC,
    AttachedRecord,
    AttachmentIndexed,
    ChannelRecord,
    ChunkIndexed,
    FooterRecord,
    MetadataIndexed,
    MetadataRecord,
    Op,
    SchemaRecord,
    Statistics,
    record,
    text,
)

__all__ = ["LIBRARY", "PROFILE", "Index", "McapFile"]

PROFILE, LIBRARY = "", "autotelic"

Index = dict[int, list[int]]
"""For each channel of a chunk the log times and places of its messages, by turns."""


class McapFile:
    """Writes records one after another and keeps what the summary needs.

    Args:
        write: takes bytes; they are in the file, in this order, when it returns.
    """

    def __init__(self, write: Callable[[bytes], object]) -> None:
        self._write = write
        self._at = self._crc = 0
        self._schemas: list[SchemaRecord] = []
        self._channels: list[ChannelRecord] = []
        self._chunks: list[ChunkIndexed] = []
        self._attached: list[AttachmentIndexed] = []
        self._metadata: list[MetadataIndexed] = []
        self._n_by_channel: dict[int, int] = {}
        self._put(MAGIC)
        self._put(record(Op.HEADER, text(PROFILE) + text(LIBRARY)))

    def add_schema(self, schema: SchemaRecord) -> None:
        """Write what messages look like, before the first channel of that kind."""
        self._schemas.append(schema)
        self._put(schema.bytes())

    def add_channel(self, channel: ChannelRecord) -> None:
        """Write a channel, before its first message; outside of chunks, so that none is lost with another's chunk."""
        self._channels.append(channel)
        self._n_by_channel.setdefault(channel.id, 0)
        self._put(channel.bytes())

    def add_chunk(self, records: bytes, index: Index) -> None:
        """Write messages' records.

        Args:
            records: one or more.
            index: where they lie in there.
        """
        times = [stamp for places in index.values() for stamp in places[::2]]
        chunk = pack_chunk(records, start_ns=min(times), end_ns=max(times))
        at, index_at = self._at, {}
        whole = chunk.bytes()
        self._put(whole)
        index_begins = self._at
        for channel, places in index.items():
            index_at[channel] = self._at
            self._n_by_channel[channel] = self._n_by_channel.get(channel, 0) + len(places) // 2
            packed = pack(f"<{len(places)}Q", *places)
            self._put(record(Op.MESSAGE_INDEX, pack("<HI", channel, len(packed)) + packed))
        self._chunks.append(
            ChunkIndexed(
                chunk.start_ns, chunk.end_ns, at, len(whole), index_at, self._at - index_begins, chunk.compression,
                len(chunk.packed), chunk.size,
            )
        )  # fmt: skip

    def add_attachment(self, attached: AttachedRecord) -> None:
        """Write a file inside the file."""
        at, whole = self._at, attached.bytes()
        self._put(whole)
        self._attached.append(
            AttachmentIndexed(
                at, len(whole), attached.log_ns, attached.create_ns, len(attached.content), attached.name,
                attached.media_type,
            )
        )  # fmt: skip

    def add_metadata(self, metadata: MetadataRecord) -> None:
        """Write a table of texts."""
        at, whole = self._at, metadata.bytes()
        self._put(whole)
        self._metadata.append(MetadataIndexed(at, len(whole), metadata.name))

    def finish(self) -> None:
        """Write the summary: the file is whole then."""
        self._put(record(Op.DATA_END, pack("<I", self._crc)))
        summary_at = self._at
        groups = (
            (Op.SCHEMA, self._schemas), (Op.CHANNEL, self._channels), (Op.STATISTICS, [self._statistics()]),
            (Op.CHUNK_INDEX, self._chunks), (Op.ATTACHMENT_INDEX, self._attached), (Op.METADATA_INDEX, self._metadata),
        )  # fmt: skip
        summary, offsets = b"", b""
        for op, members in groups:
            packed = b"".join(member.bytes() for member in members)
            if packed:
                offsets += record(Op.SUMMARY_OFFSET, pack("<BQQ", op, summary_at + len(summary), len(packed)))
            summary += packed
        offsets_at = summary_at + len(summary) if offsets else 0
        unsigned = FooterRecord(summary_at, offsets_at, 0).bytes()[:-4]
        crc = crc32(summary + offsets + unsigned)
        self._put(summary + offsets + FooterRecord(summary_at, offsets_at, crc).bytes() + MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            sum(self._n_by_channel.values()), len(self._schemas), len(self._channels), len(self._attached),
            len(self._metadata), len(self._chunks), min((c.start_ns for c in self._chunks), default=0),
            max((c.end_ns for c in self._chunks), default=0), self._n_by_channel,
        )  # fmt: skip

    def _put(self, raw: bytes) -> None:
        self._write(raw)
        self._at += len(raw)
        self._crc = crc32(raw, self._crc)
