"""Walks through the bytes of a file that may be torn, changed or several in one, and yields what is whole. Pure.

A chunk is whole when its checksum says so. Where a record cannot be read the walk goes on at the next place that looks
like a chunk or a beginning: there is one a second, at the latest.
"""

from collections.abc import Iterator
from mmap import mmap
from struct import unpack_from
from typing import NamedTuple

from robot.recording.compression import unpack_chunk
from robot.recording.errors import DamagedError
from robot.recording.records import (
    HEAD_BYTES,
    MAGIC,
    AttachedRecord,
    ChannelRecord,
    ChunkRecord,
    Cursor,
    MetadataRecord,
    Op,
    SchemaRecord,
)

__all__ = ["Begun", "Ended", "Gap", "Loose", "Unpacked", "scan"]

_COMPRESSIONS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
_BEFORE_COMPRESSION = HEAD_BYTES + 28
"""From a chunk's beginning to the name of its compression."""
_MOST_HEAD = 1 << 16


class Begun(NamedTuple):
    """A file begins here: what was said of schemas and channels before is another one's."""

    at: int


class Ended(NamedTuple):
    """A file ended here, with its summary."""

    at: int


class Gap(NamedTuple):
    """Bytes that cannot be read."""

    at: int
    length: int
    why: str


class Unpacked(NamedTuple):
    """A chunk's records."""

    at: int
    start_ns: int
    end_ns: int
    records: bytes


class Loose(NamedTuple):
    """A message outside of chunks."""

    at: int
    body: bytes


Found = Begun | Ended | Gap | Unpacked | Loose | SchemaRecord | ChannelRecord | AttachedRecord | MetadataRecord


def scan(raw: bytes | mmap) -> Iterator[Found]:
    """Yield what is in a file, from its first byte to its last, summaries left out."""
    at, end, view = 0, len(raw), memoryview(raw)
    is_summary = False
    while at < end:
        if view[at : at + len(MAGIC)] == MAGIC:
            is_begin = not is_summary
            yield Begun(at) if is_begin else Ended(at)
            is_summary = False
            at += len(MAGIC)
            continue
        try:
            op, begin, after = _head(view, at)
            is_summary = is_summary or op == Op.DATA_END
            found = None if is_summary else _found(view, op, begin, after, at)
        except DamagedError as error:
            next_at = _resume(raw, at + 1)
            yield Gap(at, next_at - at, str(error))
            at, is_summary = next_at, False
            continue
        if found is not None:
            yield found
        at = after


def _head(view: memoryview, at: int) -> tuple[int, int, int]:
    """Return what a record is, where its body begins and where it ends."""
    if len(view) - at < HEAD_BYTES:
        raise DamagedError(f"expected a record, {len(view) - at} bytes are left")
    op, length = unpack_from("<BQ", view, at)
    after = at + HEAD_BYTES + length
    if not 1 <= op <= Op.DATA_END:
        raise DamagedError(f"expected a record of kind 1 to {int(Op.DATA_END)}, got {op}")
    if after > len(view):
        raise DamagedError(f"expected a record of {length} bytes, {len(view) - at - HEAD_BYTES} are left")
    return op, at + HEAD_BYTES, after


def _found(view: memoryview, op: int, begin: int, after: int, at: int) -> Found | None:
    """Return what a record of the data section is, None for what is of no use: headers and indexes."""
    cursor = Cursor(view, begin, after)
    if op == Op.CHUNK:
        chunk = ChunkRecord.read(cursor)
        return Unpacked(at, chunk.start_ns, chunk.end_ns, unpack_chunk(chunk))
    if op == Op.MESSAGE:
        return Loose(at, bytes(view[begin:after]))
    kinds = {
        Op.SCHEMA: SchemaRecord, Op.CHANNEL: ChannelRecord, Op.ATTACHMENT: AttachedRecord, Op.METADATA: MetadataRecord,
    }  # fmt: skip
    kind = kinds.get(Op(op))
    return None if kind is None else kind.read(cursor)


def _resume(raw: bytes | mmap, at: int) -> int:
    """Return where the next chunk may begin, or another file; the end where nothing does."""
    find = raw.find
    places = [len(raw)]
    magic = find(MAGIC, at)
    if magic >= 0:
        places.append(magic)
    for name in _COMPRESSIONS:
        named = find(name, at + _BEFORE_COMPRESSION)
        while named >= 0 and raw[named - _BEFORE_COMPRESSION] != Op.CHUNK:
            named = find(name, named + 1)
        if named >= 0:
            places.append(named - _BEFORE_COMPRESSION)
    return min(places)
