"""What was asked for, kept just as it came: numbers that are none, wrong lengths and things of no known kind too.

JSON has no word for NaN or an infinity, and msgspec writes null for either, which no reader takes back for a number.
Here they are words of their own, so that one file format is as good as the other. A refusal does not fail for its
own evidence: what cannot be shown is told so. Pure.
"""

import math
from enum import StrEnum
from numbers import Integral, Real

import msgspec

__all__ = ["AsCame", "CameField", "NonFinite", "Number", "as_came", "float_of"]

MOST_NUMBERS, MOST_WORDS = 64, 200
"""More of either is cut short: what came may be anything."""
MOST_INT = 1 << 63
"""Whole numbers below this in size have an encoding."""


class NonFinite(StrEnum):
    """A number that JSON cannot write."""

    NAN = "nan"
    INFINITE = "inf"
    MINUS_INFINITE = "-inf"


Number = int | float | NonFinite


class CameField(msgspec.Struct, frozen=True, kw_only=True):
    """One field of what came."""

    name: str
    """Empty for a thing without fields."""
    numbers: tuple[Number, ...] = ()
    words: str = ""
    """What it is that is no number, or no row of numbers."""


class AsCame(msgspec.Struct, tag="as_came", frozen=True, kw_only=True):
    """Something that was asked for and not taken."""

    kind: str
    """Name of its type."""
    fields: tuple[CameField, ...]


def as_came(thing: object) -> AsCame:
    """Return what came, field by field and every number of it, whatever it is."""
    if not isinstance(thing, msgspec.Struct):
        return AsCame(kind=type(thing).__name__, fields=(_field("", thing),))
    fields: list[CameField] = []
    for name in thing.__struct_fields__:
        value = getattr(thing, name)
        if isinstance(value, msgspec.Struct):
            fields += [_field(f"{name}.{inner}", getattr(value, inner)) for inner in value.__struct_fields__]
        else:
            fields.append(_field(name, value))
    return AsCame(kind=type(thing).__name__, fields=tuple(fields))


def float_of(number: Number) -> float:
    """Return a kept number as it came, not-a-number and infinities among them."""
    return float(number)


def _field(name: str, value: object) -> CameField:
    number = _number(value)
    if number is not None:
        return CameField(name=name, numbers=(number,))
    if isinstance(value, tuple | list) and len(value) <= MOST_NUMBERS:
        numbers = [n for n in map(_number, value) if n is not None]
        if len(numbers) == len(value):
            return CameField(name=name, numbers=tuple(numbers))
    return CameField(name=name, words="" if value is None else _words(value))


def _number(value: object) -> Number | None:
    """Return a number that every encoding has, None for what is no number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    if isinstance(value, Integral):
        return int(value) if abs(int(value)) < MOST_INT else None
    try:
        number = float(value)
    except OverflowError:
        return None
    if math.isfinite(number):
        return number
    return NonFinite.NAN if math.isnan(number) else NonFinite.INFINITE if number > 0.0 else NonFinite.MINUS_INFINITE


def _words(value: object) -> str:
    """Return what a thing is, in words of some length."""
    try:
        text = value.value if isinstance(value, StrEnum) else repr(value)
    except Exception as error:  # noqa: BLE001 - anything may have come, and its words may be broken too
        text = f"{type(value).__name__}, which cannot be shown: {type(error).__name__}"
    return text[:MOST_WORDS].encode("utf-8", "backslashreplace").decode()
