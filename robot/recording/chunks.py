"""Messages that wait to be written, a chunk for each lane. Holds no clock: messages tell the time.

A chunk is closed when it is half a second old by its messages' own times, or large: the same messages make the same
chunks.
"""

from collections.abc import Callable

from robot.recording.lanes import Lane
from robot.recording.mcap_file import Index
from robot.recording.records import HEAD_BYTES, MESSAGE_HEAD, Op

__all__ = ["CHUNK_BYTES", "CHUNK_NS", "Chunks"]

CHUNK_NS = 500_000_000
"""A recorder that is killed loses what is in its open chunks, and what its thread has yet to write: a second in all."""
CHUNK_BYTES = 1 << 20
_BODY_HEAD = MESSAGE_HEAD.size - HEAD_BYTES

Out = Callable[[bytes, Index, int], object]
"""Takes a chunk's records, where they lie in there, and how many they are."""


class _Chunk:
    """Messages of one lane."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self.parts: list[bytes] = []
        self.index: Index = {}
        self.size = self.begun_ns = self.n = 0


class Chunks:
    """Gathers messages' records.

    Args:
        out: takes a chunk that is closed.
    """

    def __init__(self, out: Out) -> None:
        self._out = out
        self._chunks = {lane: _Chunk() for lane in Lane}

    def add(self, lane: Lane, channel: int, sequence: int, log_ns: int, publish_ns: int, payload: bytes) -> None:
        """Add a message."""
        chunk = self._chunks[lane]
        if not chunk.n:
            chunk.begun_ns = log_ns
        elif log_ns - chunk.begun_ns >= CHUNK_NS or chunk.size > CHUNK_BYTES:
            self._close(chunk)
            chunk.begun_ns = log_ns
        places = chunk.index.get(channel)
        if places is None:
            places = chunk.index[channel] = []
        places += (log_ns, chunk.size)
        length = len(payload)
        head = MESSAGE_HEAD.pack(Op.MESSAGE, _BODY_HEAD + length, channel, sequence & 0xFFFFFFFF, log_ns, publish_ns)
        chunk.parts += (head, payload)
        chunk.size += MESSAGE_HEAD.size + length
        chunk.n += 1

    def flush(self) -> None:
        """Close what waits, however little."""
        for chunk in self._chunks.values():
            if chunk.n:
                self._close(chunk)

    def _close(self, chunk: _Chunk) -> None:
        records, index, n = b"".join(chunk.parts), chunk.index, chunk.n
        chunk.clear()
        self._out(records, index, n)
