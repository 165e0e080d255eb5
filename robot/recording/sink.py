"""The way to the disk: a thread of its own, so that who records never waits for one. The edge.

What is handed over is carried out in its order. Where the disk is too slow and nothing may wait, the newest is left out
and counted; where it is full, or gone, nothing more is tried, and the file is cut back to its last whole record: what
it has is kept.
"""

import os
from collections.abc import Callable
from pathlib import Path
from queue import Full, Queue
from threading import Event, Thread
from time import monotonic

from robot.recording.errors import UnfitError
from robot.recording.mcap_file import McapFile

__all__ = ["FLUSHED_S", "MOST_WAITING", "Sink"]

FLUSHED_S = 1.0
"""What is older than that is on the disk, not only on its way there: a power cut loses no more."""
MOST_WAITING = 64
"""Jobs, most of them chunks of up to half a second."""

Job = Callable[[McapFile], object]


class Sink:
    """One file and the thread that writes it.

    Args:
        path: a file that does not exist yet.
        may_wait: who records may wait for the disk, as in lock-step: nothing is left out then.
        now_s: the host's time, for flushing.
    """

    def __init__(self, path: Path, *, may_wait: bool, now_s: Callable[[], float] = monotonic) -> None:
        self.path, self._may_wait, self._now_s = path, may_wait, now_s
        if path.exists():
            raise UnfitError(f"{path}: expected no file there yet; nothing is overwritten, name another")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except OSError as error:
            raise UnfitError(
                f"{path}: expected a place to record to, {(error.strerror or str(error)).lower()}"
            ) from error
        self._whole = 0
        """Bytes that hold whole records."""
        self._flushed_s = now_s()
        self._why_lost: str | None = None
        self._is_closed = False
        self._jobs: Queue[Job | None] = Queue(MOST_WAITING)
        self._ended = Event()
        self._thread = Thread(target=self._serve, name="recording", daemon=True)
        self._thread.start()

    @property
    def why_lost(self) -> str | None:
        """Why nothing more is recorded, None while it is."""
        return self._why_lost

    def put(self, job: Job) -> bool:
        """Hand over what is to be written; False where it is left out, for the disk is too slow, or lost."""
        if self._why_lost is not None or self._is_closed:
            return False
        try:
            self._jobs.put(job, block=self._may_wait)
        except Full:
            return False
        return True

    def put_surely(self, job: Job) -> bool:
        """Hand over what has to be there, as a channel has before its messages; waits if it must, outside of ticks."""
        if self._why_lost is not None or self._is_closed:
            return False
        self._jobs.put(job)
        return True

    def close(self) -> None:
        """Finish the file, if the disk is not lost, and wait for that. Idempotent."""
        if not self._is_closed:
            self.put_surely(McapFile.finish)
            self._is_closed = True
            self._jobs.put(None)
        self._thread.join()

    def _serve(self) -> None:
        file: McapFile | None = None
        while (job := self._jobs.get()) is not None:
            if self._why_lost is not None:
                continue
            try:
                if file is None:
                    file = McapFile(self._write)
                job(file)
                self._whole = os.lseek(self._fd, 0, os.SEEK_CUR)
                self._flush(is_due=self._now_s() - self._flushed_s >= FLUSHED_S)
            except OSError as error:
                self._lose(error)
        try:
            self._flush(is_due=self._why_lost is None)
        except OSError as error:
            self._lose(error)
        os.close(self._fd)

    def _write(self, raw: bytes) -> None:
        rest = memoryview(raw)
        while rest:
            rest = rest[os.write(self._fd, rest) :]

    def _flush(self, *, is_due: bool) -> None:
        if is_due:
            os.fdatasync(self._fd)
            self._flushed_s = self._now_s()

    def _lose(self, error: OSError) -> None:
        """Keep what is whole and say why nothing follows."""
        why = f"{self.path}: expected room and a disk that writes, {(error.strerror or str(error)).lower()}"
        self._why_lost = f"{why}; what was recorded until then is kept, `autotelic session recover` makes it whole"
        try:
            os.ftruncate(self._fd, self._whole)
        except OSError:
            return
