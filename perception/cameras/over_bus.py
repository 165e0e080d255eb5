"""A camera whose frames another process puts into this machine's memory and announces on the bus. State and edge."""

from collections import deque
from collections.abc import Callable
from threading import Lock
from time import monotonic_ns

import msgspec

from perception.cameras.ring import N_SLOTS, FrameReader
from perception.errors import CameraSilentError, PerceptionConfigError
from robot.bus import Bus, Received, Subscriber
from robot.bus.camera_rows import FrameNote
from robot.bus.topics import CAMERA_FRAME
from robot.frames import CameraSpec, Frame

__all__ = ["BusCamera", "FrameCounts"]

N_KEPT = N_SLOTS // 2
"""Notes that wait to be read; frames of older ones are about to be overwritten."""


class FrameCounts(msgspec.Struct, kw_only=True):
    """What became of a camera's frames on their way here."""

    read: int = 0
    lost: int = 0
    """Taken by the camera and never announced: by the gaps in its numbers."""
    torn: int = 0
    """Announced, and overwritten or unfinished when they were read."""
    late: int = 0
    """Older than the topic's deadline when they were read."""


class BusCamera:
    """The newest frame of a camera process (robot.hal.protocols.Camera).

    Args:
        bus: open.
        expected: which camera this is; frames of one with another serial or size are refused.
        now_ns: this machine's monotonic clock.

    Attributes:
        spec: the same.
        counts: what became of its frames.
    """

    def __init__(self, bus: Bus, expected: CameraSpec, *, now_ns: Callable[[], int] = monotonic_ns) -> None:
        assert CAMERA_FRAME.deadline_s is not None, "a frame grows old"
        self._bus, self.spec, self._now_ns = bus, expected, now_ns
        self.counts = FrameCounts()
        self._deadline_ns = round(CAMERA_FRAME.deadline_s * 1e9)
        self._notes: deque[FrameNote] = deque(maxlen=N_KEPT)
        self._lock = Lock()
        self._why_refused: str | None = None
        self._last: tuple[str, int] | None = None
        """Memory and camera's number of the last note that came."""
        self._since_ns = 0
        self._reader: FrameReader | None = None
        self._subscriber: Subscriber[FrameNote] | None = None

    def connect(self) -> None:
        """Hear of its frames from now on. Idempotent."""
        if self._subscriber is None:
            self._subscriber = self._bus.subscriber(CAMERA_FRAME, self._take)

    def forget(self) -> None:
        """Take no frame any more that was exposed before now: the table was laid out anew."""
        with self._lock:
            self._since_ns = self._now_ns()
            self._notes.clear()

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame that had arrived by then and was not returned before, or None.

        Raises:
            CameraSilentError: frames come, and they are another camera's, or in another machine's memory.
        """
        with self._lock:
            if self._why_refused is not None:
                raise CameraSilentError(self._why_refused)
            note: FrameNote | None = None
            while self._notes and self._notes[0].arrival_ns <= now_ns:
                note = self._notes.popleft()
        return None if note is None else self._read(note)

    def close(self) -> None:
        """Hear no more. Idempotent."""
        if self._subscriber is not None:
            self._subscriber.close()
            self._subscriber = None
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def _take(self, received: Received[FrameNote]) -> None:
        """Keep a note, on the bus's own thread."""
        note = received.message
        if note.camera != self.spec.name:
            return
        with self._lock:
            self._why_refused = self._why_not(received)
            if self._why_refused is not None or note.stamp_ns < self._since_ns:
                return
            if self._last is not None and self._last[0] == note.memory:
                self.counts.lost += max(0, note.sequence - self._last[1] - 1)
            self._last = note.memory, note.sequence
            self._notes.append(note)

    def _why_not(self, received: Received[FrameNote]) -> str | None:
        """Return why a frame is not looked at, None where it is."""
        note, spec = received.message, self.spec
        if received.age_ns is None:
            return (
                f"camera {spec.name}: expected its process on this machine, for pictures go through its memory; it "
                "runs on another"
            )
        if (note.width_px, note.height_px) != (spec.width_px, spec.height_px):
            return (
                f"camera {spec.name}: expected {spec.width_px} × {spec.height_px} pixels as calibrated, came "
                f"{note.width_px} × {note.height_px}"
            )
        if spec.serial and note.serial and note.serial != spec.serial:
            return f"camera {spec.name}: expected serial {spec.serial} as calibrated, came {note.serial}"
        return None

    def _read(self, note: FrameNote) -> Frame | None:
        try:
            frame = self._reader_of(note).take(note.number, camera=note.camera)
        except PerceptionConfigError as error:
            raise CameraSilentError(f"camera {self.spec.name}: {error}") from error
        if frame is None or (frame.sequence, frame.stamp_ns) != (note.sequence, note.stamp_ns):
            self.counts.torn += 1
            return None
        self.counts.read += 1
        self.counts.late += self._now_ns() - frame.stamp_ns > self._deadline_ns
        return frame

    def _reader_of(self, note: FrameNote) -> FrameReader:
        reader = self._reader
        if reader is None or reader.name != note.memory:
            if reader is not None:
                reader.close()
            self._reader = None
            self._reader = reader = FrameReader(note.memory)
        return reader
