"""Values as text: what to_str and str_cat make of them, and strings as the bytes that they are to a script.

A string holds one character for each byte of UTF-8, as a robot counts them and as sockets send them.
"""

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.values import Value, described

__all__ = ["MAX_SPELLED", "held", "n_characters", "spelled"]

MAX_SPELLED = 1023
"""Bytes of what to_str and str_cat return (e-Series script directory)."""


def held(text: str) -> str:
    """Return a text as scripts hold it, a character for each byte."""
    return text if text.isascii() else text.encode("utf-8", "replace").decode("latin-1")


def n_characters(text: str) -> int:
    """Return how many characters a string's bytes are: those that follow another in UTF-8 do not count."""
    return len(text) if text.isascii() else sum(ord(byte) & 0xC0 != 0x80 for byte in text)


def spelled(*values: Value) -> str:
    """Spell values out one behind the other: floats with six decimals, less trailing zeros; strings as they are.

    Raises:
        TypeError: a value is neither of these nor a bool, an integer, a pose or a list of them.
        ValueError: the text is longer than 1,023 bytes.
    """
    text = "".join(map(_spelled, values))
    if len(text) > MAX_SPELLED:
        raise _too_long()
    return text


def _spelled(value: Value) -> str:
    if type(value) is str:
        return value
    return _listed(value) if type(value) is list else _one(value)


def _listed(values: list[Value]) -> str:
    pieces: list[str] = []
    room = MAX_SPELLED
    for value in values:
        piece = str(value) if type(value) is int else _one(value)
        pieces.append(piece)
        room -= len(piece) + 2
        if room < 0:  # before the rest of a long list is gone through
            raise _too_long()
    return f"[{', '.join(pieces)}]"


def _one(value: Value) -> str:
    if type(value) is float:
        return _decimal(value)
    if type(value) is bool or type(value) is int:
        return str(value)
    if type(value) is Pose:
        return f"p[{', '.join(map(_decimal, value))}]"
    raise TypeError(f"expected a bool, a number, a pose or a list of these, got {described(value)}")


def _decimal(number: float) -> str:
    text = f"{number:.6f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _too_long() -> ValueError:
    return ValueError(f"the string is too long: expected at most {MAX_SPELLED} bytes")
