"""Cells as processes of this machine. The edge."""

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from learning.sweeping.executor import End, Job
from robot.parent import end_with_parent

__all__ = ["LocalExecutor"]

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)  # fmt: skip
"""Cells side by side would take each other's processors."""
MB = 1e6
TAIL_BYTES = 4096


def _end_with_sweep() -> None:
    """Have the kernel end this process with the sweep, however that ends; and leave Ctrl-C to the sweep."""
    os.setsid()
    end_with_parent()


class _Running:
    def __init__(self, job: Job, log: Path) -> None:
        self.job, self.log = job, log
        self._sink: IO[bytes] = log.open("ab")
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from robot.cli import main; main()", *job.words],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._sink, preexec_fn=_end_with_sweep,
            env=os.environ | ONE_THREAD,
        )  # fmt: skip
        self.why_ended = ""

    def look(self) -> End | None:
        """Return how it ended, None while it runs; one that takes too much memory is ended."""
        code = self.process.poll()
        if code is None:
            used_mb = _resident_mb(self.process.pid)
            if used_mb > self.job.memory_mb and not self.why_ended:
                self.why_ended = f"took {used_mb:.0f} MB of memory where {self.job.memory_mb} are allowed"
                self.process.kill()
            return None
        self._sink.close()
        why = None if code == 0 else self.why_ended or f"{_ending(code)}: {_last_line(self.log)}"
        return End(name=self.job.name, why_failed=why)


class LocalExecutor:
    """Implements learning.sweeping.executor.Executor by processes that end with this one.

    Args:
        n_slots: how many at a time.
        logs: folder for what each says.
    """

    def __init__(self, *, n_slots: int, logs: Path) -> None:
        self._n_slots, self._logs = n_slots, logs
        self._running: list[_Running] = []

    @property
    def n_slots(self) -> int:
        """How many jobs run at a time."""
        return self._n_slots

    def start(self, job: Job) -> None:
        """Start a process."""
        self._logs.mkdir(parents=True, exist_ok=True)
        self._running.append(_Running(job, self._logs / f"{job.name}.log"))

    def ended(self) -> Sequence[End]:
        """Return which processes ended since the last look."""
        looked = [(running, running.look()) for running in self._running]
        self._running = [running for running, end in looked if end is None]
        return [end for _, end in looked if end is not None]

    def ask_to_stop(self) -> None:
        """Send each process what Ctrl-C sends: it ends its epoch, and keeps everything."""
        for running in self._running:
            with suppress(ProcessLookupError):
                running.process.send_signal(signal.SIGINT)

    def close(self) -> None:
        """Kill what still runs."""
        for running in self._running:
            running.process.kill()
            running.process.wait()
        self._running = []


def _resident_mb(pid: int) -> float:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / MB


def _ending(code: int) -> str:
    return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"


def _last_line(path: Path) -> str:
    with path.open("rb") as log:
        log.seek(max(0, path.stat().st_size - TAIL_BYTES))
        lines = log.read().decode(errors="replace").strip().splitlines()
    return lines[-1].strip() if lines else "it said nothing"
