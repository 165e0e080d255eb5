"""What a session is of and what it holds, for a person. Pure but for reading the file."""

import msgspec

from robot.recording.session_file import SessionFile

__all__ = ["About", "Attached", "Held", "about_session"]


class Held(msgspec.Struct, frozen=True, kw_only=True):
    """One topic."""

    topic: str
    schema: str
    n: int
    rate_hz: float
    bytes_each: float


class Attached(msgspec.Struct, frozen=True, kw_only=True):
    """One attached file."""

    name: str
    n_bytes: int


class About(msgspec.Struct, frozen=True, kw_only=True):
    """A session."""

    path: str
    size: int
    seconds: float
    n_messages: int
    about: dict[str, str]
    streams: tuple[Held, ...]
    attached: tuple[Attached, ...]


def about_session(session: SessionFile) -> About:
    """Return what a session holds; topics that nothing was written to are left out."""
    statistics = session.statistics
    seconds = 0.0 if statistics is None else (statistics.end_ns - statistics.start_ns) / 1e9
    counts: dict[tuple[str, str], list[int]] = {}
    for raw in session.raw():
        channel = session.channels[raw.channel]
        schema = session.schemas.get(channel.schema)
        held = counts.setdefault((channel.topic, "" if schema is None else schema.name), [0, 0])
        held[0] += 1
        held[1] += len(raw.payload)
    streams = tuple(
        Held(topic=topic, schema=schema, n=n, rate_hz=n / seconds if seconds else 0.0, bytes_each=size / n)
        for (topic, schema), (n, size) in sorted(counts.items())
    )
    return About(
        path=str(session.path), size=session.size, seconds=seconds, n_messages=sum(s.n for s in streams),
        about=session.about, streams=streams,
        attached=tuple(Attached(name=a.name, n_bytes=a.size) for a in session.attachments()),
    )  # fmt: skip
