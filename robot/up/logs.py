"""A log for each process and one of all, as they come. The edge: files."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from threading import Lock
from typing import IO

__all__ = ["Logs"]


class Logs:
    """Writes lines into `NAME.log` and, with time and name before them, into `all.log`.

    Args:
        folder: made where there is none.
        now: the wall clock, for a person.
    """

    def __init__(self, folder: Path, *, now: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._now, self._lock = now, Lock()
        self._files: dict[str, IO[str]] = {"all": (folder / "all.log").open("a", encoding="utf-8")}

    def write(self, name: str, line: str) -> None:
        """Write a line of a process."""
        at = self._now().isoformat(timespec="milliseconds")
        with self._lock:
            if self._files["all"].closed:
                return
            own = self._files.get(name)
            if own is None:
                own = self._files[name] = (self.folder / f"{name}.log").open("a", encoding="utf-8")
            for file, text in ((own, f"{at} {line}\n"), (self._files["all"], f"{at} {name}: {line}\n")):
                file.write(text)
                file.flush()

    def close(self) -> None:
        """Shut the files. Idempotent."""
        with self._lock:
            for file in self._files.values():
                file.close()
