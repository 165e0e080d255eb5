"""A torn, changed or concatenated file becomes a whole one: what is whole in it is kept, what is not is told."""

import mmap
from pathlib import Path

import msgspec

from robot.recording.errors import DamagedError, UnfitError
from robot.recording.records import (
    AttachedRecord,
    ChannelRecord,
    Cursor,
    MetadataRecord,
    Op,
    SchemaRecord,
    messages_of,
    parts_of,
)
from robot.recording.rewriting import Rewriting
from robot.recording.scan import Begun, Ended, Gap, Loose, Unpacked, scan

__all__ = ["Lost", "Recovered", "recover"]


class Lost(msgspec.Struct, frozen=True, kw_only=True):
    """Bytes that could not be read."""

    at: int
    n_bytes: int
    why: str


class Recovered(msgspec.Struct, frozen=True, kw_only=True):
    """What was saved, and what was not."""

    n_messages: int
    n_files: int
    """Files that lay one after another in the one."""
    was_whole: bool
    lost: tuple[Lost, ...]
    n_unknown: int
    """Messages of channels that nothing is known of any more."""
    end_ns: int
    """Newest log time that was saved."""


class _Recovery:
    """What is known of the file that is being read."""

    def __init__(self, out: Rewriting) -> None:
        self._out = out
        self._lost: list[Lost] = []
        self._n_files = self._n_ended = self._n_unknown = self._end_ns = 0
        self._begin()

    def _begin(self) -> None:
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, ChannelRecord] = {}
        self._numbers: dict[int, int] = {}

    def take_in(self, found: object) -> None:
        """Keep one thing that was found."""
        if isinstance(found, Begun):
            self._n_files += 1
            self._begin()
        elif isinstance(found, Ended):
            self._n_ended += 1
        elif isinstance(found, Gap):
            self._lost.append(Lost(at=found.at, n_bytes=found.length, why=found.why))
        elif isinstance(found, SchemaRecord):
            self._schemas[found.id] = found
        elif isinstance(found, ChannelRecord):
            self._channels[found.id] = found
            self._numbers[found.id] = self._out.channel(found, self._schemas.get(found.schema))
        elif isinstance(found, AttachedRecord):
            self._out.attach(found)
        elif isinstance(found, MetadataRecord):
            self._out.note(found)
        elif isinstance(found, Loose):
            self._loose(found)
        elif isinstance(found, Unpacked):
            self._chunk(found)

    def _loose(self, found: Loose) -> None:
        try:
            self._message(_loose(found.body))
        except DamagedError as error:
            self._lost.append(Lost(at=found.at, n_bytes=len(found.body), why=str(error)))

    def _chunk(self, found: Unpacked) -> None:
        records = found.records
        try:
            for op, begin, after in parts_of(records):
                if op == Op.SCHEMA:
                    self.take_in(SchemaRecord.read(Cursor(records, begin, after)))
                elif op == Op.CHANNEL:
                    self.take_in(ChannelRecord.read(Cursor(records, begin, after)))
            for message in messages_of(records):
                self._message(message)
        except DamagedError as error:
            self._lost.append(Lost(at=found.at, n_bytes=0, why=str(error)))

    def _message(self, message: tuple[int, int, int, int, bytes]) -> None:
        channel, _, log_ns, publish_ns, payload = message
        known = self._channels.get(channel)
        if known is None:
            self._n_unknown += 1
            return
        self._end_ns = max(self._end_ns, log_ns)
        self._out.message(self._numbers[channel], known.topic, log_ns, publish_ns, payload)

    def told(self) -> Recovered:
        """Return what came of it."""
        return Recovered(
            n_messages=self._out.n_messages, n_files=self._n_files, n_unknown=self._n_unknown, end_ns=self._end_ns,
            was_whole=self._n_files == self._n_ended == 1 and not self._lost, lost=tuple(self._lost),
        )  # fmt: skip


def recover(path: Path, out: Path) -> Recovered:
    """Write what is whole in a file into a new one.

    Raises:
        UnfitError: there is no such file, or the new one cannot be written.
        DamagedError: nothing in it is whole.
    """
    try:
        with path.open("rb") as opened:
            size = path.stat().st_size
            raw = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) if size else b""
    except OSError as error:
        raise UnfitError(f"{path}: expected a session's file, {(error.strerror or str(error)).lower()}") from error
    rewriting = Rewriting(out)
    try:
        recovery = _Recovery(rewriting)
        for thing in scan(raw):
            recovery.take_in(thing)
    finally:
        rewriting.close()
    if not rewriting.n_messages:
        out.unlink()
        raise DamagedError(f"{path}: expected something whole to save, found no message among {size} bytes")
    return recovery.told()


def _loose(body: bytes) -> tuple[int, int, int, int, bytes]:
    """Return a message that lies outside of chunks.

    Raises:
        DamagedError: it is too short to be one.
    """
    cursor = Cursor(body)
    return cursor.whole(2), cursor.whole(4), cursor.whole(8), cursor.whole(8), cursor.take(cursor.end - cursor.at)
