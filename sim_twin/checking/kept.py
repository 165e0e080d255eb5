"""What a check has run, kept as it comes: the same command goes on where it was, interrupted or killed. An edge."""

import hashlib
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from sim_twin.checking.check import Block, Setup
from sim_twin.checking.mutations import Outcome
from sim_twin.checking.ring import StreamResult

__all__ = ["KeptOutcomes", "KeptStreams", "origin_of"]

CODE, LIBRARIES = ("config", "robot", "sim_twin"), ("mujoco", "numpy", "placo", "ruckig")


class _Line(msgspec.Struct, frozen=True, kw_only=True):
    """One line in a file: what came of something, and of which check."""

    origin: str


class _Streams(_Line, frozen=True, kw_only=True):
    """One block of streams."""

    streams: list[StreamResult]


class _Weakened(_Line, frozen=True, kw_only=True):
    """One limit that was weakened."""

    outcome: Outcome


L = TypeVar("L", bound=_Line)


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


class _Kept(Generic[L]):
    """Lines of one check in a file that others' may be in; without a folder nothing is kept."""

    def __init__(self, folder: Path | None, name: str, setup: Setup, kind: type[L]) -> None:
        self._path = None if folder is None else folder / name
        self.origin = "" if folder is None else origin_of(setup)
        self._kind = kind

    def __iter__(self) -> Iterator[L]:
        if self._path is None or not self._path.exists():
            return
        for line in self._path.read_bytes().splitlines():
            try:
                read = msgspec.json.decode(line, type=self._kind)
            except msgspec.DecodeError:
                continue  # the last one of a process that was killed as it wrote
            if read.origin == self.origin:
                yield read

    def add(self, line: L) -> None:
        if self._path is None:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("ab") as file:
            file.write(b"\n" + msgspec.json.encode(line))  # ahead of it: a line that was cut off ends there


class KeptStreams:
    """The streams of one check in a folder's `streams.jsonl`; without a folder nothing is kept.

    Args:
        folder: where; made if it is not there.
        setup: which check. What another one, or other code, left there is not taken for its own.
    """

    def __init__(self, folder: Path | None, setup: Setup) -> None:
        self._lines = _Kept(folder, "streams.jsonl", setup, _Streams)
        self._came = {came.number: came for line in self._lines for came in line.streams}

    def of(self, block: Block) -> list[StreamResult] | None:
        """Return what came of a block's streams, None unless all of them were run."""
        came = [self._came.get(number) for number in block.streams]
        whole = [one for one in came if one is not None]
        return whole if len(whole) == len(came) else None

    def add(self, streams: Iterable[StreamResult]) -> None:
        """Keep what came of a block."""
        self._lines.add(_Streams(origin=self._lines.origin, streams=list(streams)))


class KeptOutcomes:
    """What came of each limit that was weakened, in a folder's `weakened.jsonl`, as KeptStreams keeps streams."""

    def __init__(self, folder: Path | None, setup: Setup) -> None:
        self._lines = _Kept(folder, "weakened.jsonl", setup, _Weakened)
        self.by_limit = {line.outcome.limit: line.outcome for line in self._lines}

    def add(self, outcome: Outcome) -> None:
        """Keep what came of one limit."""
        self.by_limit[outcome.limit] = outcome
        self._lines.add(_Weakened(origin=self._lines.origin, outcome=outcome))
