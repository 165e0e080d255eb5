"""Parts of sessions, and several as one."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from heapq import merge as merged
from pathlib import Path

from robot.recording.errors import UnfitError
from robot.recording.records import AttachedRecord, MetadataRecord
from robot.recording.rewriting import Rewriting
from robot.recording.session_file import Raw, SessionFile
from robot.recording.topics import EPOCH, RESET_MARK, STATION

__all__ = ["Span", "cut", "epochs_span", "merge"]

Found = tuple[int, int, bytes, SessionFile, int]
"""Log time, publish time, payload, where it is from, and its channel there."""
Span = tuple[int, int]
"""From, up to before; log times."""
ALWAYS = (STATION.name,)
"""Told once, at the beginning; a part needs it too."""


def cut(path: Path, out: Path, *, span: Span, topics: Sequence[str] | None = None) -> int:
    """Write the messages of a span of a session, of some topics or of all, and return how many they are.

    Raises:
        UnfitError: nothing lies in the span, or a file is none.
        DamagedError: the session is torn.
    """
    with SessionFile(path) as session:
        known = {channel.topic for channel in session.channels.values()}
        unknown = sorted(set(topics or ()) - known)
        if unknown:
            raise UnfitError(f"{path}: expected topics of {', '.join(sorted(known))}, got {unknown[0]}")
        wanted = None if topics is None else {*topics, *ALWAYS}

        def is_kept(raw: Raw) -> bool:
            return span[0] <= raw.log_ns < span[1] or session.topic_of(raw.channel) in ALWAYS

        found = (raw for raw in session.raw(wanted) if is_kept(raw))
        return _write([session], [_found_of(session, found)], out)


def epochs_span(session: SessionFile, first: int, last: int) -> Span:
    """Return from where epoch `first` is laid out up to the end of `last`.

    Raises:
        UnfitError: there are no such epochs.
    """
    begins: list[tuple[int, int]] = [(raw.log_ns, mark.epoch) for _, raw, mark in session.messages(RESET_MARK)]
    inside = [at for at, epoch in begins if first <= epoch <= last]
    if not inside:
        known = f"{min(e for _, e in begins)} to {max(e for _, e in begins)}" if begins else "none"
        raise UnfitError(f"{session.path}: expected epochs of {known}, got {first} to {last}")
    ends = [raw.log_ns + 1 for _, raw, outcome in session.messages(EPOCH) if outcome.epoch == last]
    after = [at for at, epoch in begins if at > inside[-1] and not first <= epoch <= last]
    end = min(after) if after else (session.statistics.end_ns + 1 if session.statistics else inside[-1] + 1)
    return min(inside), max([end, *ends])


def merge(paths: Sequence[Path], out: Path) -> int:
    """Write several sessions into one, by their log times, and return how many messages there are.

    Their clocks must be one: sessions that were recorded beside one another, or parts of one. What lies in two of them
    to the last bit is written once.

    Raises:
        UnfitError: fewer than two, or of different plants or clocks.
        DamagedError: one is torn.
    """
    if len(paths) < 2:
        raise UnfitError("expected two sessions or more to merge")
    with ExitStack() as stack:
        sessions = [stack.enter_context(SessionFile(path)) for path in paths]
        for key in ("serial", "scenario", "clock"):
            found = {session.about.get(key, "") for session in sessions}
            if len(found) > 1:
                raise UnfitError(f"expected sessions of one {key}, got {', '.join(sorted(found))}")
        streams = [_found_of(session, session.raw()) for session in sessions]
        return _write(sessions, streams, out)


def _found_of(session: SessionFile, raws: Iterable[Raw]) -> Iterator[Found]:
    for raw in raws:
        yield raw.log_ns, raw.publish_ns, raw.payload, session, raw.channel


def _write(sessions: Sequence[SessionFile], streams: Sequence[Iterator[Found]], out: Path) -> int:
    rewriting = Rewriting(out)
    numbers: dict[tuple[int, int], int] = {}
    seen: set[tuple[int, int, int, bytes]] = set()
    try:
        for session in sessions:
            _head(session, rewriting)
        for log_ns, publish_ns, payload, session, channel in merged(*streams, key=_time):
            key = (id(session), channel)
            record = session.channels[channel]
            if key not in numbers:
                numbers[key] = rewriting.channel(record, session.schemas.get(record.schema))
            alike = (numbers[key], log_ns, publish_ns, payload)
            if len(sessions) > 1:
                if alike in seen:
                    continue
                seen.add(alike)
            rewriting.message(numbers[key], record.topic, log_ns, publish_ns, payload)
    finally:
        rewriting.close()
    if not rewriting.n_messages:
        out.unlink()
        raise UnfitError(f"{sessions[0].path}: expected messages in that part, there are none")
    return rewriting.n_messages


def _time(found: Found) -> int:
    return found[0]


def _head(session: SessionFile, rewriting: Rewriting) -> None:
    for name, values in session.metadata().items():
        rewriting.note(MetadataRecord(name, values))
    for indexed in session.attachments():
        content = session.attachment(indexed.name)
        assert content is not None, "it was listed"
        rewriting.attach(
            AttachedRecord(indexed.log_ns, indexed.create_ns, indexed.name, indexed.media_type, content)
        )  # fmt: skip
