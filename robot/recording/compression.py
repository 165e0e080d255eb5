"""Chunks compressed and back, with a bound on what a wrong byte may make us allocate. Pure."""

from zlib import crc32

import lz4.frame
import zstandard

from robot.recording.errors import DamagedError
from robot.recording.records import ChunkRecord

__all__ = ["MOST_BYTES", "pack_chunk", "unpack_chunk"]

MOST_BYTES = 256 << 20
"""No chunk of ours comes near it; more than that is a damaged length."""
LEVEL = 3


def pack_chunk(records: bytes, *, start_ns: int, end_ns: int) -> ChunkRecord:
    """Return records as a chunk."""
    packed = zstandard.ZstdCompressor(level=LEVEL).compress(records)
    return ChunkRecord(start_ns, end_ns, len(records), crc32(records), "zstd", packed)


def unpack_chunk(chunk: ChunkRecord) -> bytes:
    """Return a chunk's records.

    Raises:
        DamagedError: they are not what was written, or compressed in a way that is not known here.
    """
    if chunk.size > MOST_BYTES:
        raise DamagedError(f"a chunk: expected at most {MOST_BYTES} bytes, it says {chunk.size}")
    try:
        raw = _unpacked(chunk)
    except (zstandard.ZstdError, RuntimeError, ValueError, EOFError, MemoryError) as error:
        raise DamagedError(f"a chunk that cannot be unpacked: {error}") from error
    if len(raw) != chunk.size or (chunk.crc and crc32(raw) != chunk.crc):
        raise DamagedError(f"a chunk: expected {chunk.size} bytes with checksum {chunk.crc:08x}, got others")
    return raw


def _unpacked(chunk: ChunkRecord) -> bytes:
    if chunk.compression == "zstd":
        return _unzstd(chunk)
    if chunk.compression == "lz4":
        with lz4.frame.LZ4FrameDecompressor() as opened:
            return opened.decompress(chunk.packed, max_length=chunk.size + 1)
    if not chunk.compression:
        return chunk.packed
    raise DamagedError(f"a chunk: expected compression zstd, lz4 or none, got {chunk.compression[:20]!r}")


def _unzstd(chunk: ChunkRecord) -> bytes:
    told = zstandard.frame_content_size(chunk.packed)
    if told not in (-1, chunk.size):
        raise DamagedError(f"a chunk: expected {chunk.size} bytes unpacked, its frame says {told}")
    return zstandard.ZstdDecompressor().decompress(chunk.packed, max_output_size=chunk.size)
