"""A session as a file for viewers that know Foxglove's messages as Protocol Buffers alone, Rerun among them. The edge.

All else is in it as it was. Where a session has no frames and shapes of its own they are drawn from what was measured
and perceived.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from robot.bus.topic import Topic
from robot.bus.topics import ARM_STATE, CAMERA_IMAGE, PERCEPT
from robot.messages import ArmState
from robot.recording.origin import resolved_of
from robot.recording.picture import Picture
from robot.recording.protobuf import descriptors, encode
from robot.recording.records import AttachedRecord, ChannelRecord, MetadataRecord, SchemaRecord
from robot.recording.rewriting import Rewriting
from robot.recording.session_file import Raw, SessionFile
from robot.recording.shown import Shown
from robot.recording.topics import SCENE, TF
from robot.recording.viewer_kinds import KINDS

__all__ = ["write_viewer_file"]

DRAWN = (TF, SCENE, CAMERA_IMAGE)
ENCODING = "protobuf"


def write_viewer_file(path: Path, out: Path) -> str:
    """Write a session for viewers, and return in words what is drawn in it.

    Raises:
        UnfitError: the new file is there already, or there is no room.
        DamagedError: the session is torn.
    """
    with SessionFile(path) as session:
        writing = Rewriting(out)
        for name, values in session.metadata().items():
            writing.note(MetadataRecord(name, values))
        for attached in session.attachments():
            content = session.attachment(attached.name) or b""
            writing.attach(
                AttachedRecord(attached.log_ns, attached.create_ns, attached.name, attached.media_type, content)
            )
        numbers = {topic.name: writing.channel(*_records_of(topic)) for topic in DRAWN}
        drawn = {topic.name for topic in DRAWN}
        others = {channel.topic for channel in session.channels.values()} - drawn
        for raw in session.raw(others):
            channel = session.channels[raw.channel]
            number = writing.channel(channel, session.schemas.get(channel.schema))
            writing.message(number, channel.topic, raw.log_ns, raw.publish_ns, raw.payload)
        n = dict.fromkeys(drawn, 0)
        for topic, log_ns, publish_ns, message in _drawn_in(session):
            payload = encode(KINDS[topic.kind], message)
            writing.message(numbers[topic.name], topic.name, log_ns, publish_ns, payload)
            n[topic.name] += 1
        writing.close()
    return ", ".join(f"{count} of {name}" for name, count in sorted(n.items()))


def _records_of(topic: Topic[Any]) -> tuple[ChannelRecord, SchemaRecord]:
    """Return what a topic's channel is, and what its messages look like."""
    kind = KINDS[topic.kind]
    return ChannelRecord(0, 0, topic.name, ENCODING, {}), SchemaRecord(0, kind.name, ENCODING, descriptors(kind))


def _drawn_in(session: SessionFile) -> Iterator[tuple[Topic[Any], int, int, Any]]:
    """Yield what viewers draw, with its times."""
    if any(True for _ in session.raw([TF.name])):
        yield from ((topic, raw.log_ns, raw.publish_ns, message) for topic, raw, message in session.messages(*DRAWN))
        return
    made: list[tuple[Topic[Any], int, int, Any]] = []
    resolved = resolved_of(session)
    shown = Shown(_Made(made), Picture(resolved.arm, resolved.scenario))
    state: ArmState | None = None
    raw: Raw
    for topic, raw, message in session.messages(ARM_STATE, PERCEPT, CAMERA_IMAGE):
        if topic is ARM_STATE:
            state = message
        elif topic is PERCEPT:
            shown.perceived(message, state, log_ns=raw.log_ns)
        else:
            made.append((topic, raw.log_ns, raw.publish_ns, message))
        yield from made
        made.clear()


class _Made:
    """Takes what is drawn (robot.recording.taps.Writes)."""

    def __init__(self, made: list[tuple[Topic[Any], int, int, Any]]) -> None:
        self._made = made

    def write(self, topic: Topic[Any], message: msgspec.Struct, *, log_ns: int, stamp_ns: int | None = None) -> bytes:
        """Take one."""
        self._made.append((topic, log_ns, log_ns if stamp_ns is None else stamp_ns, message))
        return b""
