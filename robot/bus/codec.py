"""Messages to bytes and back: the Structs in JSON, a field of bytes beside it as it is.

JSON has no NaN and no infinities, and msgspec writes null for them, which reads as "there is none" or not at all. A
message that holds one has it in words that begin with a mark (~NaN, ~Infinity, ~-Infinity), a text of its own that
begins so has the mark twice, and its envelope says that there are words. All other messages are plain. Words are not
left to a reader's leniency: that would take any text for a number wherever the type has room for either.
"""

import math
from functools import cache
from hashlib import blake2b
from typing import Generic, NamedTuple, TypeVar

import msgspec

from robot.bus.envelope import SCHEMA_BYTES, Origin
from robot.bus.errors import MalformedError, SchemaError

__all__ = ["Codec", "Encoded", "schema_hash"]

T = TypeVar("T", bound=msgspec.Struct)

MARK = "~"
WORDS = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


class Encoded(NamedTuple):
    """A message as it travels."""

    payload: bytes
    beside: bytes
    """What travels behind the envelope: the JSON, where the payload is a field of bytes; else nothing."""
    has_words: bool


class Codec(Generic[T]):
    """Encodes and decodes messages of one type.

    Args:
        kind: A Struct with at most one field of bytes.
        is_whole: A field of bytes is in the JSON, too, in base 64, as files and viewers have it.

    Attributes:
        kind: The same.
        schema: Its hash.
    """

    def __init__(self, kind: type[T], *, is_whole: bool = False) -> None:
        self.kind, self.schema = kind, schema_hash(kind)
        blobs = [field.name for field in msgspec.structs.fields(kind) if field.type is bytes and not is_whole]
        assert len(blobs) <= 1, f"{kind.__name__}: at most one field of bytes"
        self._blob = blobs[0] if blobs else None
        self._encode = msgspec.json.Encoder().encode
        self._decode = msgspec.json.Decoder(kind).decode

    def encode(self, message: T) -> Encoded:
        """Return a message as it travels, whatever numbers it holds."""
        if self._blob is None:
            text, has_words = self._text_of(message)
            return Encoded(text, b"", has_words)
        blob = getattr(message, self._blob)
        text, has_words = self._text_of(msgspec.structs.replace(message, **{self._blob: b""}))
        return Encoded(blob, text, has_words)

    def decode(self, payload: bytes, beside: bytes, *, has_words: bool) -> T:
        """Return the message.

        Raises:
            MalformedError: it is none of this type.
        """
        decode = self._decode_worded if has_words else self._decode
        try:
            if self._blob is None:
                return decode(payload)
            return msgspec.structs.replace(decode(beside), **{self._blob: payload})
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            raise MalformedError(f"expected a {self.kind.__name__} in JSON: {error}") from error

    def check_schema(self, origin: Origin, *, name: str, reader: str) -> None:
        """Check that a message was written with the type as it is here.

        Raises:
            SchemaError: it was not; both sides are named.
        """
        if origin.schema != self.schema:
            raise SchemaError(
                f"{name}: expected {self.kind.__name__} with schema {self.schema.hex()} as {reader} has it, got "
                f"{origin.schema.hex()} from {origin.source}; do both run the same version?"
            )

    def _decode_worded(self, text: bytes) -> T:
        return msgspec.convert(_in_numbers(msgspec.json.decode(text)), self.kind, str_keys=True)

    def _text_of(self, message: object) -> tuple[bytes, bool]:
        text = self._encode(message)
        if b"null" not in text:  # which every number that is not finite leaves behind
            return text, False
        worded, has_words = _in_words(msgspec.to_builtins(message))
        return (self._encode(worded), True) if has_words else (text, False)


@cache
def schema_hash(kind: type) -> bytes:
    """Return 8 bytes that change with what a type is on the wire: names, types, defaults; not with its docstrings."""
    schema = msgspec.json.schema(kind)
    text = msgspec.json.encode(_undescribed(schema), order="deterministic")
    return blake2b(text, digest_size=SCHEMA_BYTES).digest()


def _undescribed(value: object) -> object:
    if isinstance(value, dict):
        return {key: _undescribed(item) for key, item in value.items() if not _is_prose(key, item)}
    return [_undescribed(item) for item in value] if isinstance(value, list) else value


def _is_prose(key: object, item: object) -> bool:
    """Tell a description from a field of that name, which is a schema itself."""
    return key == "description" and isinstance(item, str)


def _in_words(value: object) -> tuple[object, bool]:
    """Return plain values with words for what is not finite, and whether there are any."""
    if isinstance(value, float) and not math.isfinite(value):
        return MARK + ("NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"), True
    if isinstance(value, str):
        return (MARK + value if value.startswith(MARK) else value), False
    if isinstance(value, dict):
        found = {key: _in_words(item) for key, item in value.items()}
        return {key: item for key, (item, _) in found.items()}, any(is_in for _, is_in in found.values())
    if isinstance(value, list | tuple):
        items = [_in_words(item) for item in value]
        return [item for item, _ in items], any(is_in for _, is_in in items)
    return value, False


def _in_numbers(value: object) -> object:
    """Return plain values with numbers for their words again.

    Raises:
        ValueError: a marked text is none of them.
    """
    if isinstance(value, str) and value.startswith(MARK):
        text = value.removeprefix(MARK)
        if text.startswith(MARK):
            return text
        if text not in WORDS:
            raise ValueError(f"expected one of {', '.join(WORDS)} after {MARK}, got {text[:20]!r}")
        return WORDS[text]
    if isinstance(value, dict):
        return {key: _in_numbers(item) for key, item in value.items()}
    return [_in_numbers(item) for item in value] if isinstance(value, list) else value
