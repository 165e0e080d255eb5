"""What is written on the outside of each message, 56 bytes: which type, from whom, the how many-th, and when.

It travels as the attachment of a Zenoh message. Times are of the source's monotonic clock; whether that is one's own
clock too is told by the number of the clock, which a machine draws when it boots.
"""

import re
from struct import Struct as Form

import msgspec

from robot.bus.errors import MalformedError
from robot.bus.topic import NAME

__all__ = ["ENVELOPE_BYTES", "SCHEMA_BYTES", "Envelope", "check_source", "pack", "unpack"]

MAGIC, VERSION = b"AT", 1
SCHEMA_BYTES = 8
HAS_WORDS = 1
_FORM = Form("<2sBB8sIqQq16s")
ENVELOPE_BYTES = _FORM.size
_SOURCE = re.compile(NAME)


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """The outside of one message."""

    schema: bytes
    """Hash of the type that it was written with."""
    clock: int
    """Which clock the times are of."""
    begun_ns: int
    """When the source began to write this topic: a source that was started anew counts from 0 again."""
    sequence: int
    """How many the source had written there before."""
    stamp_ns: int
    """When what it tells of was so, as the source knows it."""
    source: str
    has_words: bool = False
    """Numbers that are not finite are in words (see robot.bus.codec)."""


def check_source(source: str) -> str:
    """Return a source's name.

    Raises:
        MalformedError: it has other than 1 to 16 small letters, digits and underscores.
    """
    if not _SOURCE.fullmatch(source):
        raise MalformedError(f"bus: expected a source's name ({NAME}), got {source!r}")
    return source


def pack(envelope: Envelope) -> bytes:
    """Return the 56 bytes of an envelope."""
    return _FORM.pack(
        MAGIC, VERSION, HAS_WORDS if envelope.has_words else 0, envelope.schema, envelope.clock, envelope.begun_ns,
        envelope.sequence, envelope.stamp_ns, envelope.source.encode("ascii"),
    )  # fmt: skip


def unpack(raw: bytes) -> tuple[Envelope, bytes]:
    """Return an envelope and what follows it.

    Raises:
        MalformedError: it is none of ours.
    """
    if len(raw) < ENVELOPE_BYTES:
        raise MalformedError(f"expected an envelope of {ENVELOPE_BYTES} bytes, got {len(raw)}")
    magic, version, flags, schema, clock, begun_ns, sequence, stamp_ns, padded = _FORM.unpack_from(raw)
    if (magic, version) != (MAGIC, VERSION) or flags & ~HAS_WORDS:
        raise MalformedError(f"expected an envelope that begins with {MAGIC!r} {VERSION}, got {raw[:4]!r}")
    try:
        source = check_source(padded.rstrip(b"\0").decode("ascii"))
    except UnicodeDecodeError as error:
        raise MalformedError(f"expected a source's name ({NAME}), got {padded!r}") from error
    return Envelope(
        schema=schema, clock=clock, begun_ns=begun_ns, sequence=sequence, stamp_ns=stamp_ns, source=source,
        has_words=bool(flags & HAS_WORDS),
    ), raw[ENVELOPE_BYTES:]  # fmt: skip
