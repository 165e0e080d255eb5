"""A sweep under way: which cell is started next, which again, and which is given up. State, no clock, no terminal."""

from collections import deque
from collections.abc import Callable
from pathlib import Path

import msgspec

from config.sweep import Sweep
from learning.sweeping.cells import Cell, cells_of, epochs_done, is_finished, words_of
from learning.sweeping.executor import End, Executor, Job
from learning.sweeping.manifest import Failure, SweepManifest, write_manifest

__all__ = ["SweepRunner"]


class SweepRunner:
    """Runs the cells that are not finished, and those that fail again while they come on.

    Args:
        manifest: what was begun in the folder.
        folder: of the sweep; each cell has one inside it.
        executor: runs cells.
        tell: hears of what happens, a line each.

    Attributes:
        cells: All of the sweep.
        running: Those under way.
        given_up: Those that failed too often without coming on, and why.
    """

    def __init__(
        self,
        manifest: SweepManifest,
        *,
        folder: Path,
        executor: Executor,
        tell: Callable[[str], object],
    ) -> None:
        self._manifest, self._folder, self._executor, self._tell = manifest, folder, executor, tell
        self.cells = cells_of(manifest.sweep)
        self.running: dict[str, Cell] = {}
        self.given_up: dict[str, str] = {}
        self._waiting = deque(cell for cell in self.cells if not is_finished(cell, folder))
        self._begun_at: dict[str, int] = {}
        self._n_vain: dict[str, int] = {}
        """Starts that came no further, one after the other."""
        self._is_stopping = False

    @property
    def sweep(self) -> Sweep:
        """What is run."""
        return self._manifest.sweep

    @property
    def folder(self) -> Path:
        """Where."""
        return self._folder

    @property
    def n_finished(self) -> int:
        """Cells whose runs are whole."""
        return sum(is_finished(cell, self._folder) for cell in self.cells)

    @property
    def is_over(self) -> bool:
        """Whether nothing runs, and nothing is to be started any more."""
        return not self.running and (self._is_stopping or not self._waiting)

    def look(self) -> None:
        """Take note of what ended, and start what there is room for."""
        for end in self._executor.ended():
            self._take(end)
        while self._waiting and not self._is_stopping and len(self.running) < self._executor.n_slots:
            self._start(self._waiting.popleft())

    def stop(self) -> None:
        """Start nothing any more, and ask what runs to come to an end that loses nothing."""
        if not self._is_stopping:
            self._is_stopping = True
            self._executor.ask_to_stop()

    def _start(self, cell: Cell) -> None:
        self._begun_at[cell.name] = epochs_done(cell, self._folder)
        self.running[cell.name] = cell
        words = words_of(cell, self.sweep, self._folder)
        self._executor.start(Job(name=cell.name, words=words, memory_mb=self.sweep.cell_memory_mb))
        at = self._begun_at[cell.name]
        self._tell(f"{cell.name}: {f'goes on from about epoch {at}' if at else 'begins'}")

    def _take(self, end: End) -> None:
        cell = self.running.pop(end.name)
        if is_finished(cell, self._folder):
            self._tell(f"{cell.name}: finished")
        elif not self._is_stopping:
            self._fail(cell, end.why_failed or "ended before its epochs were done, and said that all was well")

    def _fail(self, cell: Cell, why: str) -> None:
        at = epochs_done(cell, self._folder)
        failure = Failure(cell=cell.name, epoch=at, why=why)
        failures = (*self._manifest.failures, failure)
        self._manifest = msgspec.structs.replace(self._manifest, failures=failures)
        write_manifest(self._folder, self._manifest)
        n_vain = 0 if at > self._begun_at[cell.name] else self._n_vain.get(cell.name, 0)
        self._n_vain[cell.name] = n_vain + 1
        if self._n_vain[cell.name] >= self.sweep.tries:
            self.given_up[cell.name] = why
            self._tell(f"{cell.name}: given up after {self.sweep.tries} tries at epoch {at}: {why}")
        else:
            self._waiting.append(cell)
            self._tell(f"{cell.name}: failed at epoch {at} and is tried again: {why}")
