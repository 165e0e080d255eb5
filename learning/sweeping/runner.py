"""A sweep under way: its cells as tasks, and what failed of them kept in its manifest. State, no clock, no terminal."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from config.sweep import Sweep
from learning.sweeping.cells import Cell, cells_of, epochs_done, is_finished, words_of
from learning.sweeping.executor import Executor, Job
from learning.sweeping.manifest import Failure, SweepManifest, write_manifest
from learning.sweeping.retrying import JobRunner

__all__ = ["SweepRunner"]


class _CellTask:
    """A cell as what is run until its run is whole (learning.sweeping.retrying.Task)."""

    def __init__(self, cell: Cell, sweep: Sweep, folder: Path) -> None:
        self._cell, self._sweep, self._folder = cell, sweep, folder

    @property
    def name(self) -> str:
        return self._cell.name

    def job(self) -> Job:
        words = words_of(self._cell, self._sweep, self._folder)
        return Job(name=self.name, words=words, memory_mb=self._sweep.cell_memory_mb)

    def n_done(self) -> int:
        return epochs_done(self._cell, self._folder)

    def is_finished(self) -> bool:
        return is_finished(self._cell, self._folder)


class SweepRunner(JobRunner):
    """Runs the cells that are not finished, and those that fail again while they come on.

    Args:
        manifest: what was begun in the folder.
        folder: of the sweep; each cell has one inside it.
        executor: runs cells.
        tell: hears of what happens, a line each.

    Attributes:
        cells: All of the sweep.
    """

    def __init__(
        self,
        manifest: SweepManifest,
        *,
        folder: Path,
        executor: Executor,
        tell: Callable[[str], object],
    ) -> None:
        self._manifest, self._folder = manifest, folder
        self.cells = cells_of(manifest.sweep)
        tasks = [_CellTask(cell, manifest.sweep, folder) for cell in self.cells]
        super().__init__(
            tasks, executor=executor, tries=manifest.sweep.tries, tell=tell, when_failed=self._keep_failure
        )

    @property
    def sweep(self) -> Sweep:
        """What is run."""
        return self._manifest.sweep

    @property
    def folder(self) -> Path:
        """Where."""
        return self._folder

    def _keep_failure(self, name: str, at: int, why: str) -> None:
        failures = (*self._manifest.failures, Failure(cell=name, epoch=at, why=why))
        self._manifest = msgspec.structs.replace(self._manifest, failures=failures)
        write_manifest(self._folder, self._manifest)
