"""What a sweep's folder says of itself: the sweep, and what failed so far. How far cells are is in their own."""

from pathlib import Path

import msgspec

from config.sweep import Sweep
from learning.checkpoint import write_atomically
from learning.errors import RunFolderError

__all__ = ["Failure", "SweepManifest", "read_manifest", "take_folder", "write_manifest"]

FORMAT = 1
MANIFEST_NAME = "sweep.json"


class Failure(msgspec.Struct, frozen=True, kw_only=True):
    """One start of a cell that did not end well."""

    cell: str
    epoch: int
    """How far the cell was."""
    why: str


class SweepManifest(msgspec.Struct, frozen=True, kw_only=True):
    """A sweep that was begun in a folder."""

    format: int = FORMAT
    sweep: Sweep
    failures: tuple[Failure, ...] = ()
    """Of all sessions, oldest first."""


def read_manifest(folder: Path) -> SweepManifest | None:
    """Return what was begun in a folder, None where nothing was.

    Raises:
        RunFolderError: its manifest cannot be read.
    """
    path = folder / MANIFEST_NAME
    try:
        manifest = msgspec.json.decode(path.read_bytes(), type=SweepManifest)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RunFolderError(
            f"{path}: expected the JSON object that a sweep begins with, came: {error}; bring it back from a copy, or "
            "name another folder by --out"
        ) from error
    if manifest.format != FORMAT:
        raise RunFolderError(f"{path}: expected format {FORMAT}, got {manifest.format}")
    return manifest


def take_folder(folder: Path, sweep: Sweep) -> SweepManifest:
    """Return the manifest of a sweep that is begun or gone on with in a folder.

    Raises:
        RunFolderError: the folder holds another sweep, or something else.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        foreign = sorted(entry.name for entry in folder.iterdir() if entry.name != "lock" and entry.suffix != ".tmp")
        if foreign:
            raise RunFolderError(f"{folder}: expected an empty or new folder, found {foreign[0]} in it")
        manifest = SweepManifest(sweep=sweep)
        write_manifest(folder, manifest)
    elif msgspec.structs.replace(manifest.sweep, description="") != msgspec.structs.replace(sweep, description=""):
        raise RunFolderError(
            f"{folder} holds another sweep ({manifest.sweep.name}, {len(manifest.sweep.seeds)} seeds): go on with that "
            "one, or name another folder by --out"
        )
    return manifest


def write_manifest(folder: Path, manifest: SweepManifest) -> None:
    """Write it so that it is there as before or as it is now."""
    write_atomically(folder / MANIFEST_NAME, msgspec.json.format(msgspec.json.encode(manifest), indent=2) + b"\n")
