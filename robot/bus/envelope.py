"""What is written on the outside of each message, 56 bytes: which type, from whom, the how many-th, and when.

It travels as the attachment of a Zenoh message. Times are of the source's monotonic clock; whether that is one's own
clock too is told by the number of the clock, which a machine draws when it boots.
"""

import re
from struct import Struct as Form

import msgspec

from robot.bus.errors import MalformedError
from robot.bus.topic import NAME

__all__ = [
    "ENVELOPE_BYTES", "HEAD_BYTES", "SCHEMA_BYTES", "Envelope", "Origin", "check_source", "pack_head", "pack_tail",
    "unpack", "unpack_head", "unpack_tail",
]  # fmt: skip

MAGIC, VERSION = b"AT", 1
SCHEMA_BYTES = 8
HAS_WORDS = 1
_HEAD, _TAIL = Form("<2sB8sIq16s"), Form("<BQq")
HEAD_BYTES = _HEAD.size
"""Of what is the same in all messages that one source writes to one topic."""
ENVELOPE_BYTES = HEAD_BYTES + _TAIL.size
_SOURCE = re.compile(NAME)


class Origin(msgspec.Struct, frozen=True, kw_only=True):
    """Where messages come from."""

    schema: bytes
    """Hash of the type that they are written with."""
    clock: int
    """Which clock their times are of."""
    begun_ns: int
    """When the source began to write this topic: a source that was started anew counts from 0 again."""
    source: str


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """The outside of one message."""

    origin: Origin
    sequence: int
    """How many the source had written there before."""
    stamp_ns: int
    """When what it tells of was so, as the source knows it."""
    has_words: bool = False
    """Numbers that are not finite are in words (see robot.bus.codec)."""

    @property
    def source(self) -> str:
        """Who wrote it."""
        return self.origin.source


def check_source(source: str) -> str:
    """Return a source's name.

    Raises:
        MalformedError: it has other than 1 to 16 small letters, digits and underscores.
    """
    if not _SOURCE.fullmatch(source):
        raise MalformedError(f"expected an envelope with a source's name ({NAME}), got {source!r}")
    return source


def pack_head(origin: Origin) -> bytes:
    """Return the first 39 bytes of all envelopes of an origin."""
    return _HEAD.pack(MAGIC, VERSION, origin.schema, origin.clock, origin.begun_ns, origin.source.encode("ascii"))


def pack_tail(sequence: int, stamp_ns: int, *, has_words: bool) -> bytes:
    """Return the last 17 bytes of an envelope."""
    return _TAIL.pack(HAS_WORDS if has_words else 0, sequence, stamp_ns)


def unpack_head(raw: bytes) -> Origin:
    """Return where a message comes from.

    Raises:
        MalformedError: its envelope is none of ours.
    """
    if len(raw) < ENVELOPE_BYTES:
        raise MalformedError(f"expected an envelope of {ENVELOPE_BYTES} bytes, got {len(raw)}")
    magic, version, schema, clock, begun_ns, padded = _HEAD.unpack_from(raw)
    if (magic, version) != (MAGIC, VERSION):
        raise MalformedError(f"expected an envelope that begins with {MAGIC!r} {VERSION}, got {raw[:3]!r}")
    try:
        source = check_source(padded.rstrip(b"\0").decode("ascii"))
    except UnicodeDecodeError as error:
        raise MalformedError(f"expected an envelope with a source's name ({NAME}), got {padded!r}") from error
    return Origin(schema=schema, clock=clock, begun_ns=begun_ns, source=source)


def unpack_tail(raw: bytes, origin: Origin) -> Envelope:
    """Return a whole envelope of an origin that is known.

    Raises:
        MalformedError: it breaks off, or asks for what this version does not know.
    """
    if len(raw) < ENVELOPE_BYTES:
        raise MalformedError(f"expected an envelope of {ENVELOPE_BYTES} bytes, got {len(raw)}")
    flags, sequence, stamp_ns = _TAIL.unpack_from(raw, HEAD_BYTES)
    if flags > HAS_WORDS:
        raise MalformedError(f"expected an envelope with flags 0 or {HAS_WORDS}, got {flags}")
    return Envelope(origin=origin, sequence=sequence, stamp_ns=stamp_ns, has_words=flags == HAS_WORDS)


def unpack(raw: bytes) -> tuple[Envelope, bytes]:
    """Return an envelope and what follows it.

    Raises:
        MalformedError: it is none of ours.
    """
    return unpack_tail(raw, unpack_head(raw)), raw[ENVELOPE_BYTES:]
