"""Tables on disk that grow row by row and can be cut back to the rows that a checkpoint knew."""

import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Self

from learning.errors import RunFolderError
from learning.rows import EvaluationRow, GoalRow, GraphRow, Row, TrialRow, cells, header

__all__ = ["TABLES", "Tables"]

TABLES: dict[str, type[Row]] = {
    "trials": TrialRow,
    "goals": GoalRow,
    "graphs": GraphRow,
    "evaluations": EvaluationRow,
}
"""Every table of a run by its name; the file is <name>.csv."""


class Tables:
    """The open tables of one run. Row counts tell a checkpoint how far they reached."""

    def __init__(self, folder: Path, *, n_rows: dict[str, int] | None = None) -> None:
        """Open the tables.

        Args:
            folder: the run folder.
            n_rows: how many rows of each table to keep, what follows is cut off; None starts all anew.

        Raises:
            RunFolderError: a table has fewer rows than are to be kept.
        """
        self._n_rows = dict.fromkeys(TABLES, 0) if n_rows is None else {name: n_rows[name] for name in TABLES}
        for name, row_type in TABLES.items():
            path = folder / f"{name}.csv"
            if n_rows is None:
                path.write_text(header(row_type) + "\n", encoding="utf-8")
            else:
                _cut(path, n_rows[name])
        self._files = {name: (folder / f"{name}.csv").open("ab") for name in TABLES}

    def append(self, name: str, rows: Iterable[Row]) -> None:
        """Add rows to a table."""
        lines = [cells(row) + "\n" for row in rows]
        self._files[name].write("".join(lines).encode())
        self._n_rows[name] += len(lines)

    def n_rows(self, name: str) -> int:
        """How many rows a table has."""
        return self._n_rows[name]

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


def _cut(path: Path, n_rows: int) -> None:
    """Cut a table after so many rows."""
    lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
    n_whole = sum(line.endswith(b"\n") for line in lines) - 1
    if n_whole < n_rows:
        raise RunFolderError(f"{path}: expected the {n_rows} rows that the checkpoint counts on, got {max(0, n_whole)}")
    with path.open("r+b") as file:
        file.truncate(sum(len(line) for line in lines[: n_rows + 1]))
