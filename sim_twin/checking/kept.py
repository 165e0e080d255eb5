"""What a check has run, kept as it comes: the same command goes on where it was, interrupted or killed. An edge."""

import hashlib
from collections.abc import Iterable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import msgspec

from sim_twin.checking.check import Block, Setup
from sim_twin.checking.ring import StreamResult

__all__ = ["KeptStreams", "origin_of"]

CODE, LIBRARIES = ("config", "robot", "sim_twin"), ("mujoco", "numpy", "placo", "ruckig")


class _Line(msgspec.Struct, frozen=True, kw_only=True):
    """One block of streams in the file."""

    origin: str
    streams: list[StreamResult]


def origin_of(setup: Setup) -> str:
    """Return a digest of what streams come out by: the check, the code and the libraries; another is another check."""
    digest = hashlib.sha256(msgspec.json.encode(setup))
    for package in CODE:
        spec = find_spec(package)
        (root,) = spec.submodule_search_locations if spec and spec.submodule_search_locations else [""]
        for path in sorted(Path(root).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    digest.update(" ".join(version(name) for name in LIBRARIES).encode())
    return digest.hexdigest()


class KeptStreams:
    """The streams of one check in a folder's `streams.jsonl`; without a folder nothing is kept.

    Args:
        folder: where; made if it is not there.
        setup: which check. What another one, or other code, left there is not taken for its own.
    """

    def __init__(self, folder: Path | None, setup: Setup) -> None:
        self._path = None if folder is None else folder / "streams.jsonl"
        self._origin = "" if folder is None else origin_of(setup)
        self._came: dict[int, StreamResult] = {}
        if self._path is not None and self._path.exists():
            for line in self._path.read_bytes().splitlines():
                self._take(line)

    def _take(self, line: bytes) -> None:
        try:
            read = msgspec.json.decode(line, type=_Line)
        except msgspec.DecodeError:
            return  # the last one of a process that was killed as it wrote
        if read.origin == self._origin:
            self._came |= {came.number: came for came in read.streams}

    def of(self, block: Block) -> list[StreamResult] | None:
        """Return what came of a block's streams, None unless all of them were run."""
        came = [self._came.get(number) for number in block.streams]
        whole = [one for one in came if one is not None]
        return whole if len(whole) == len(came) else None

    def add(self, streams: Iterable[StreamResult]) -> None:
        """Keep what came of a block."""
        if self._path is None:
            return
        line = msgspec.json.encode(_Line(origin=self._origin, streams=list(streams)))
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("ab") as file:
            file.write(b"\n" + line)  # ahead of it: a line that was cut off ends there
