"""Runs found under a path: a run folder, or the run folders inside it. What is passed over is told, never dropped."""

from pathlib import Path

import msgspec

from learning.errors import RunFolderError
from learning.run_folder import CONFIG_NAME, MANIFEST_NAME, PROFILE_NAME, STOPS_NAME, RunFolder
from learning.tables import TABLES

__all__ = ["Found", "find_runs"]

NEEDED = (MANIFEST_NAME, CONFIG_NAME)
OF_A_RUN = (MANIFEST_NAME, *(f"{name}.csv" for name in TABLES), "checkpoints")
"""What only a run leaves."""
PERHAPS_OF_A_RUN = (CONFIG_NAME, PROFILE_NAME, STOPS_NAME, "summary.json")
"""What a run leaves, and other things are called too: a report has a summary."""


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """What a path holds, in order of the names."""

    folders: tuple[RunFolder, ...]
    broken: tuple[str, ...] = ()
    """Of each folder inside that was a run's and lacks what one begins with, what is wrong with it, in a line."""
    passed_over: tuple[str, ...] = ()
    """Of each folder inside that is no run's, but holds something that a run leaves, what it holds, in a line."""


def find_runs(path: Path) -> Found:
    """Return the run that a path is the folder of, or those inside it.

    Folders inside that hold nothing of a run, such as pictures or notes, are not told of.

    Raises:
        RunFolderError: there is no run, nor what is left of one.
    """
    folder = RunFolder(path)
    if folder.holds_run():
        return Found(folders=(folder,))
    inside = sorted(entry for entry in path.iterdir() if entry.is_dir()) if path.is_dir() else []
    told = {entry: _broken(entry) for entry in inside if not RunFolder(entry).holds_run()}
    found = Found(
        folders=tuple(RunFolder(entry) for entry in inside if entry not in told),
        broken=tuple(line for line in told.values() if line),
        passed_over=tuple(note for entry, line in told.items() if not line and (note := _strange(entry))),
    )
    if not found.folders and (wrong := _broken(path)):
        raise RunFolderError(wrong)
    if not found.folders and not found.broken:
        also = "".join(f"; passed over {note}" for note in found.passed_over)
        raise RunFolderError(f"{path}: expected a run folder or a folder of run folders, found no run.json{also}")
    return found


def _broken(path: Path) -> str:
    """Return what a folder lacks that was a run's, empty where it was none."""
    left = [name for name in OF_A_RUN if (path / name).exists()]
    if not left:
        return ""
    missing = " and ".join(name for name in NEEDED if not (path / name).is_file())
    return (
        f"{path}: expected {' and '.join(NEEDED)} beside {left[0]}, found no {missing}: bring them back from a copy, "
        "or leave this run out; its tables can be read without"
    )


def _strange(path: Path) -> str:
    """Return what a folder that is no run's holds of one, empty where it holds nothing of the kind."""
    deeper = sorted(entry.parent for entry in path.glob("**/run.json"))
    if deeper:
        return f"{path}: holds runs further in, name it itself: {deeper[0]}"
    left = [name for name in PERHAPS_OF_A_RUN if (path / name).is_file()]
    return f"{path}: holds {' and '.join(left)}, but no run" if left else ""
