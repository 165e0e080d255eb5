"""Frames in shared memory: one process writes a ring of slots, others read; a torn frame is none. State and edge.

A slot says which frame is begun in it, then holds stamps and pixels, then says which frame is whole. A reader copies
the pixels and looks at both numbers again after: a frame that was overwritten meanwhile, or whose writer was killed in
the middle of it, is not handed on.

Zenoh's own shared memory is not used for pictures: it takes a buffer back from a reader that stands still for 100 ms,
who is then none the wiser, and whoever only counts a topic's messages would be sent whole pictures over the network.
"""

import mmap
import os
import re
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from struct import Struct as Form

from perception.errors import PerceptionConfigError
from robot.bus.camera_rows import MEMORY_NAME
from robot.frames import Frame

__all__ = ["N_SLOTS", "FrameReader", "FrameWriter"]

SHARED = Path("/dev/shm")
"""Where Linux keeps files in memory."""
MAGIC = b"ATFRAME1"
N_SLOTS = 8
_HEAD, _NUMBER, _ABOUT = Form("<8sQQ"), Form("<Q"), Form("<QqqII")
HEAD_BYTES, BEGUN_AT, DONE_AT, ABOUT_AT, PIXELS_AT = 64, 0, 8, 16, 64
MOST_BYTES = 1 << 30


class FrameWriter:
    """Writes the frames of one camera, each into the slot after the last.

    Args:
        owner: whose memory it is, such as the plant's serial and the process's name; what dead processes of that name
            left behind is given back.
        n_bytes: of one frame's pixels.

    Attributes:
        name: under which readers find it.

    Raises:
        PerceptionConfigError: there is no room.
    """

    def __init__(self, owner: str, *, n_bytes: int) -> None:
        prefix = f"autotelic-{re.sub('[^A-Za-z0-9_.]', '_', owner)[:60]}"
        _sweep(prefix)
        self.name = f"{prefix}-{os.getpid()}-{token_hex(4)}"
        self.n_bytes, self._stride, self._n = n_bytes, PIXELS_AT + n_bytes, 0
        size = HEAD_BYTES + N_SLOTS * self._stride
        try:
            file = os.open(SHARED / self.name, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        except OSError as error:
            raise PerceptionConfigError(f"expected to share memory in {SHARED}, came: {error}") from error
        try:
            os.posix_fallocate(file, 0, size)  # else a full disk would be told by a bus error when it is written to
            self._map = mmap.mmap(file, size)
        except OSError as error:
            (SHARED / self.name).unlink(missing_ok=True)
            raise PerceptionConfigError(
                f"expected {size / 1e6:.0f} MB free in {SHARED} for pictures, came: {error}"
            ) from error
        finally:
            os.close(file)
        _HEAD.pack_into(self._map, 0, MAGIC, N_SLOTS, n_bytes)

    def put(self, frame: Frame) -> int:
        """Write a frame over the oldest one, and return its number there.

        Raises:
            PerceptionConfigError: it has another number of bytes than all before.
        """
        if len(frame.pixels) != self.n_bytes:
            raise PerceptionConfigError(
                f"camera {frame.camera}: expected {self.n_bytes} bytes a frame, came {len(frame.pixels)}"
            )
        at = self.begin()
        self._map[at + PIXELS_AT : at + self._stride] = frame.pixels
        about = (frame.sequence, frame.stamp_ns, frame.arrival_ns, frame.width_px, frame.height_px)
        _ABOUT.pack_into(self._map, at + ABOUT_AT, *about)
        _NUMBER.pack_into(self._map, at + DONE_AT, self._n)
        return self._n

    def begin(self) -> int:
        """Say that the next frame is begun, and return where its slot is; what lay there is gone."""
        self._n += 1
        at = HEAD_BYTES + self._n % N_SLOTS * self._stride
        _NUMBER.pack_into(self._map, at + BEGUN_AT, self._n)
        return at

    def close(self) -> None:
        """Give the memory back; who reads it may finish. Idempotent."""
        with suppress(OSError):
            (SHARED / self.name).unlink(missing_ok=True)
        if not self._map.closed:
            self._map.close()


class FrameReader:
    """Reads frames that another process writes.

    Args:
        name: of its memory.

    Raises:
        PerceptionConfigError: there is no such memory on this machine, or it is none of ours.
    """

    def __init__(self, name: str) -> None:
        if re.fullmatch(MEMORY_NAME, name) is None:
            raise PerceptionConfigError(f"expected a name of shared memory, came {name!r}")
        self.name = name
        try:
            file = os.open(SHARED / name, os.O_RDONLY | os.O_NOFOLLOW)
        except OSError as error:
            raise PerceptionConfigError(
                f"expected pictures in this machine's memory ({name}), came: {error}; the camera's process and the one "
                "that perceives run on one machine, as one user"
            ) from error
        try:
            size = os.fstat(file).st_size
            self._map = mmap.mmap(file, size, prot=mmap.PROT_READ) if HEAD_BYTES < size < MOST_BYTES else None
        finally:
            os.close(file)
        magic, self._n_slots, self._n_bytes = (b"", 0, 0) if self._map is None else _HEAD.unpack_from(self._map)
        self._stride = PIXELS_AT + self._n_bytes
        if magic != MAGIC or self._map is None or HEAD_BYTES + self._n_slots * self._stride != len(self._map):
            raise PerceptionConfigError(f"expected pictures in the memory {name}, came something else")

    def take(self, number: int, *, camera: str) -> Frame | None:
        """Return a frame by its number; None where it is not whole: overwritten, or never finished.

        Args:
            number: of the frame, in this memory.
            camera: whose it is, for the frame.
        """
        memory = self._map
        assert memory is not None, "it was opened"
        at = HEAD_BYTES + number % self._n_slots * self._stride
        if _NUMBER.unpack_from(memory, at + DONE_AT)[0] != number:
            return None
        sequence, stamp_ns, arrival_ns, width, height = _ABOUT.unpack_from(memory, at + ABOUT_AT)
        pixels = memory[at + PIXELS_AT : at + self._stride]
        if _NUMBER.unpack_from(memory, at + BEGUN_AT)[0] != number:
            return None
        return Frame(
            camera=camera, sequence=sequence, stamp_ns=stamp_ns, arrival_ns=arrival_ns, width_px=width,
            height_px=height, pixels=pixels,
        )  # fmt: skip

    def close(self) -> None:
        """Let go of the memory. Idempotent."""
        if self._map is not None and not self._map.closed:
            self._map.close()


def _sweep(prefix: str) -> None:
    """Give back what processes that are no more have left under a name."""
    for path in SHARED.glob(f"{prefix}-*"):
        owner = path.name.removeprefix(f"{prefix}-").split("-")[0]
        if owner.isdecimal() and not Path(f"/proc/{owner}").exists():
            path.unlink(missing_ok=True)
