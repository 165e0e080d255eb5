"""Checkpoints: a learner's whole state in one file, bit for bit, never pickled.

A file is an uncompressed zip of `state.json` (the tree, with arrays replaced by references), `arrays/<i>.npy` and
`sha256.json` (a digest of each other entry). The same state always makes the same bytes.
"""

import hashlib
import io
import json
import lzma
import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from learning.errors import CheckpointError

__all__ = ["CheckpointStore", "decode", "encode", "taking_up", "write_atomically"]

State = dict[str, Any]
_EPOCH_OF_ZIP = (1980, 1, 1, 0, 0, 0)
_NAME = re.compile(r"^checkpoint-(\d{8})\.zip$")
_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    EOFError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""What zipfile, json and numpy raise on changed bytes: a flag that says encrypted, a size beyond memory, no entry."""


# ------------------------------------------------------------------------------------------------------ the format


def encode(state: State) -> bytes:
    """Return the state as checkpoint bytes.

    Raises:
        CheckpointError: something in it cannot be kept exactly; the message names the place.
    """
    arrays: list[np.ndarray] = []
    tree = _flatten(state, "state", arrays)
    entries = {"state.json": json.dumps(tree, allow_nan=False, separators=(",", ":")).encode()}
    entries |= {f"arrays/{i}.npy": _array_bytes(array) for i, array in enumerate(arrays)}
    entries["sha256.json"] = json.dumps(
        {name: hashlib.sha256(raw).hexdigest() for name, raw in entries.items()}
    ).encode()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, raw in entries.items():
            archive.writestr(zipfile.ZipInfo(name, _EPOCH_OF_ZIP), raw)
    return buffer.getvalue()


def decode(raw: bytes) -> State:
    """Return the state held by checkpoint bytes. Raises CheckpointError if they are torn or changed."""
    try:
        return _decode(raw)
    except _UNREADABLE as error:
        message = f"not a whole checkpoint: {str(error) or type(error).__name__}"
        raise CheckpointError(message) from error


def _decode(raw: bytes) -> State:
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    digests = json.loads(entries.pop("sha256.json"))
    if digests != {name: hashlib.sha256(entry).hexdigest() for name, entry in entries.items()}:
        raise CheckpointError("the checkpoint's digests do not match what it holds")
    state = _unflatten(json.loads(entries["state.json"]), entries)
    if not isinstance(state, dict):
        raise CheckpointError("a checkpoint holds one mapping at its root")
    return state


def _flatten(value: object, place: str, arrays: list[np.ndarray]) -> object:
    """Replace arrays and non-finite floats by tagged mappings, checking every leaf's exact type."""
    if value is None or type(value) in (bool, int, str):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"$float": repr(float(value))}
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise CheckpointError(f"{place}: an array of Python objects cannot be kept without pickling")
        arrays.append(value)
        return {"$array": len(arrays) - 1}
    if type(value) is list:
        return [_flatten(entry, f"{place}[{i}]", arrays) for i, entry in enumerate(value)]
    if type(value) is dict:
        return {_key(key, place): _flatten(entry, f"{place}.{key}", arrays) for key, entry in value.items()}
    raise CheckpointError(
        f"{place}: expected None, bool, int, float, str, list, dict or a NumPy array, got {type(value).__name__}"
    )


def _key(key: object, place: str) -> str:
    if type(key) is not str or key.startswith("$"):
        raise CheckpointError(f"{place}: keys are strings that do not start with $, got {key!r}")
    return key


def _unflatten(value: Any, entries: dict[str, bytes]) -> Any:  # noqa: ANN401 - a JSON tree
    if isinstance(value, list):
        return [_unflatten(entry, entries) for entry in value]
    if not isinstance(value, dict):
        return value
    if "$array" in value:
        return np.lib.format.read_array(io.BytesIO(entries[f"arrays/{value['$array']}.npy"]), allow_pickle=False)
    if "$float" in value:
        return float(value["$float"])
    return {key: _unflatten(entry, entries) for key, entry in value.items()}


def _array_bytes(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, allow_pickle=False)
    return buffer.getvalue()


# -------------------------------------------------------------------------------------------------------- the files


def write_atomically(path: Path, raw: bytes) -> None:
    """Write a file so that whoever reads it finds the old bytes or the new ones, also after a power cut."""
    temporary = path.with_name(path.name + ".tmp")
    with temporary.open("wb") as file:
        file.write(raw)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@contextmanager
def taking_up() -> Iterator[None]:
    """Guard the reading of a state: one that another version kept may lack what this one looks for.

    Raises:
        CheckpointError: the state in hand is not of this version's layout.
    """
    try:
        yield
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise CheckpointError(
            f"expected a checkpoint as this version keeps it, came another ({type(error).__name__}: {error}); use the "
            "version that began the run (run.json names it), or begin a run of its own in another folder by --out"
        ) from error


KEPT_NAME = "milestones"
"""Folder beside the checkpoints for those that are never removed."""


class CheckpointStore:
    """The checkpoints of one run: the last two are kept, a torn newest falls back to the one before."""

    def __init__(self, folder: Path, *, keep: int = 2) -> None:
        self._folder = folder
        self._kept = folder.with_name(KEPT_NAME)
        self._keep = keep

    def save(self, epoch: int, raw: bytes) -> Path:
        """Write checkpoint bytes for an epoch boundary, then remove all but the newest `keep`."""
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"checkpoint-{epoch:08d}.zip"
        write_atomically(path, raw)
        for old in (*self._paths()[self._keep :], *self._folder.glob("*.tmp")):
            old.unlink(missing_ok=True)
        return path

    def keep(self, epoch: int, raw: bytes) -> Path:
        """Write the state of an epoch boundary that is worth a look later; it is never removed."""
        self._kept.mkdir(parents=True, exist_ok=True)
        path = self._kept / f"checkpoint-{epoch:08d}.zip"
        write_atomically(path, raw)
        return path

    def before(self, epoch: int) -> State | None:
        """Return the newest whole state of at most so many epochs, kept or not; None where there is none."""
        named = {path: int(path.stem.rsplit("-", 1)[-1]) for path in (*self._paths(), *_paths(self._kept))}
        for path in sorted((path for path, done in named.items() if done <= epoch), key=lambda path: -named[path]):
            try:
                return decode(path.read_bytes())
            except (CheckpointError, OSError):
                continue
        return None

    def newest(self) -> tuple[State, list[str]]:
        """Return the newest whole state and, in words, which newer files were passed over as torn.

        Raises:
            CheckpointError: no checkpoint can be read.
        """
        passed_over: list[str] = []
        for path in self._paths():
            try:
                return decode(path.read_bytes()), passed_over
            except (CheckpointError, OSError) as error:
                passed_over.append(f"{path.name}: {error}")
        reasons = "; ".join(passed_over) or "there is none"
        raise CheckpointError(f"no readable checkpoint in {self._folder} ({reasons})")

    def exists(self) -> bool:
        """Whether there is any checkpoint, whole or not."""
        return bool(self._paths())

    def _paths(self) -> list[Path]:
        """Checkpoint files, newest first."""
        return _paths(self._folder)


def _paths(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted((path for path in folder.iterdir() if _NAME.match(path.name)), reverse=True)
