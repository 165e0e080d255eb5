"""A session's file with one message changed."""

import msgspec

from robot.recording.records import AttachedRecord, MetadataRecord
from robot.recording.rewriting import Rewriting
from robot.recording.session_file import SessionFile

__all__ = ["with_changed"]


def with_changed(path, out, *, topic, nth, change=None, leave_out=()):
    """Write a session anew, its nth message of a topic changed (None: left out), attachments of some names left out."""
    with SessionFile(path) as session:
        rewriting = Rewriting(out)
        for name, values in session.metadata().items():
            rewriting.note(MetadataRecord(name, values))
        for a in session.attachments():
            if a.name not in leave_out:
                content = session.attachment(a.name)
                rewriting.attach(AttachedRecord(a.log_ns, a.create_ns, a.name, a.media_type, content))
        n = 0
        for raw in session.raw():
            channel = session.channels[raw.channel]
            payload, publish_ns = raw.payload, raw.publish_ns
            if channel.topic == topic:
                n += 1
                if n == nth:
                    if change is None:
                        continue
                    changed = change(msgspec.json.decode(payload))
                    payload, publish_ns = msgspec.json.encode(changed), changed.get("stamp_ns", publish_ns)
            number = rewriting.channel(channel, session.schemas.get(channel.schema))
            rewriting.message(number, channel.topic, raw.log_ns, publish_ns, payload)
        rewriting.close()
    return out
