"""Tables on disk that grow row by row and can be cut back to where a checkpoint knew them."""

import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from learning.errors import RunFolderError
from learning.rows import EvaluationRow, GoalRow, Row, TrialRow, cells, header

__all__ = ["TABLES", "Tables"]

TABLES: dict[str, type[Row]] = {"trials": TrialRow, "goals": GoalRow, "evaluations": EvaluationRow}
"""Every table of a run by its name; the file is <name>.csv."""


class Tables:
    """The open tables of one run. Byte offsets tell a checkpoint how far they reached."""

    def __init__(self, folder: Path, *, offsets: dict[str, int] | None = None) -> None:
        """Open the tables.

        Args:
            folder: the run folder.
            offsets: where to cut each table back to; None starts them anew.

        Raises:
            RunFolderError: a table is shorter than the checkpoint knew it.
        """
        if offsets is not None:
            for name in TABLES:
                _cut(folder / f"{name}.csv", offsets[name])
        mode = "wb" if offsets is None else "ab"
        self._files = {name: (folder / f"{name}.csv").open(mode) for name in TABLES}
        self._offsets = dict.fromkeys(TABLES, 0) if offsets is None else {name: offsets[name] for name in TABLES}
        if offsets is None:
            for name, row_type in TABLES.items():
                self._write(name, header(row_type) + "\n")
            self.flush()

    def append(self, name: str, rows: Iterable[Row]) -> None:
        """Add rows to a table."""
        self._write(name, "".join(cells(row) + "\n" for row in rows))

    def offset(self, name: str) -> int:
        """How many bytes a table has."""
        return self._offsets[name]

    def flush(self) -> None:
        """Let other programs see every row."""
        for file in self._files.values():
            file.flush()

    def sync(self) -> None:
        """Bring every row to the disk itself, so that a checkpoint may count on it."""
        self.flush()
        for file in self._files.values():
            os.fsync(file.fileno())

    def close(self) -> None:
        """Flush and close. Idempotent."""
        for file in self._files.values():
            file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _write(self, name: str, text: str) -> None:
        self._offsets[name] += self._files[name].write(text.encode())


def _cut(path: Path, offset: int) -> None:
    n_bytes = path.stat().st_size if path.exists() else 0
    if n_bytes < offset:
        raise RunFolderError(
            f"{path}: expected at least the {offset} bytes that the checkpoint counts on, got {n_bytes}"
        )
    with path.open("r+b") as file:
        file.truncate(offset)
