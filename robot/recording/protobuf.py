"""Messages in Protocol Buffers, and what they look like: version 3 of the format, written out. Pure.

For a handful of kinds of message: the library that others use brings a compiler and generated code, and stands beside
as the independent reader in the tests. What is written has a number for every field that is not its type's zero.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from struct import pack
from typing import Any, NamedTuple

__all__ = ["Field", "Kind", "descriptors", "encode"]

VARINT, FIXED64, COUNTED = 0, 1, 2
DOUBLE, INT64, INT32, BOOL, STRING, MESSAGE, BYTES = 1, 3, 5, 8, 9, 11, 12
"""Types of fields, as descriptors number them."""
TYPES = {"double": DOUBLE, "int64": INT64, "int32": INT32, "bool": BOOL, "string": STRING, "bytes": BYTES}
OPTIONAL, REPEATED = 1, 3
SEVEN_BITS, MORE = 0x7F, 0x80
SIGNED = 0xFFFF_FFFF_FFFF_FFFF
"""Whole numbers below zero are written as what they are modulo 2^64."""


class Field(NamedTuple):
    """One field."""

    attribute: str
    """Of what is encoded."""
    name: str
    number: int
    kind: "Kind | str"
    """A message's, or one of TYPES."""
    is_repeated: bool = False


class Kind(NamedTuple):
    """One kind of message."""

    name: str
    """With its package."""
    fields: tuple[Field, ...]


def encode(kind: Kind, message: object) -> bytes:
    """Return a message's bytes; its fields are taken from attributes of their names."""
    parts: list[bytes] = []
    for field in kind.fields:
        value = getattr(message, field.attribute)
        for one in value if field.is_repeated else (value,):
            if isinstance(field.kind, Kind):
                parts.append(_counted(field.number, encode(field.kind, one)))
            elif one or field.is_repeated:
                parts.append(_plain(field.number, field.kind, one))
    return b"".join(parts)


def _plain(number: int, kind: str, value: Any) -> bytes:  # noqa: ANN401 - of the field's kind
    if kind == "double":
        return _head(number, FIXED64) + pack("<d", value)
    if kind in ("int64", "int32", "bool"):
        return _head(number, VARINT) + _varint(int(value) & SIGNED)
    return _counted(number, value.encode() if kind == "string" else value)


def _counted(number: int, raw: bytes) -> bytes:
    return _head(number, COUNTED) + _varint(len(raw)) + raw


@cache
def _head(number: int, wire: int) -> bytes:
    return _varint(number << 3 | wire)


def _varint(value: int) -> bytes:
    """Return a whole number, seven bits a byte, the lowest first."""
    found = bytearray()
    while value > SEVEN_BITS:
        found.append(value & SEVEN_BITS | MORE)
        value >>= 7
    found.append(value)
    return bytes(found)


def descriptors(kind: Kind) -> bytes:
    """Return what a kind of message looks like, with all that it holds: a FileDescriptorSet, a file each package."""
    kinds = _all_of(kind)
    by_package: dict[str, list[Kind]] = {}
    for one in kinds:
        by_package.setdefault(_split(one)[0], []).append(one)
    own = _split(kind)[0]
    packages = sorted(by_package, key=lambda package: package == own)
    files = [_file(package, by_package[package], packages[:n]) for n, package in enumerate(packages)]
    return b"".join(_counted(1, file) for file in files)


def _all_of(kind: Kind) -> Sequence[Kind]:
    """Return a kind and all that it holds, what is held first."""
    found: dict[str, Kind] = {}
    for field in kind.fields:
        if isinstance(field.kind, Kind):
            found |= {inner.name: inner for inner in _all_of(field.kind)}
    return [*found.values(), kind]


def _split(kind: Kind) -> tuple[str, str]:
    package, _, name = kind.name.rpartition(".")
    return package, name


def _file(package: str, kinds: Iterable[Kind], needs: Iterable[str]) -> bytes:
    """Return a FileDescriptorProto: name 1, package 2, dependency 3, message_type 4, syntax 12."""
    told = _texts({1: f"{package}.proto", 2: package})
    told += b"".join(_counted(3, f"{other}.proto".encode()) for other in needs)
    return told + b"".join(_counted(4, _message(kind)) for kind in kinds) + _texts({12: "proto3"})


def _message(kind: Kind) -> bytes:
    """Return a DescriptorProto: name 1, field 2."""
    return _texts({1: _split(kind)[1]}) + b"".join(_counted(2, _field(field)) for field in kind.fields)


def _field(field: Field) -> bytes:
    """Return a FieldDescriptorProto: name 1, number 3, label 4, type 5, type_name 6."""
    is_message = isinstance(field.kind, Kind)
    number = MESSAGE if isinstance(field.kind, Kind) else TYPES[field.kind]
    told = _texts({1: field.name})
    for at, value in ((3, field.number), (4, REPEATED if field.is_repeated else OPTIONAL), (5, number)):
        told += _head(at, VARINT) + _varint(value)
    return told + (_texts({6: f".{field.kind.name}"}) if is_message and isinstance(field.kind, Kind) else b"")


def _texts(values: Mapping[int, str]) -> bytes:
    return b"".join(_counted(number, text.encode()) for number, text in values.items())
