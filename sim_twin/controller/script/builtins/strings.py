"""Functions of strings, which are bytes to them, and what turns strings into numbers and back."""

import math
import re

from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.builtins.arguments import integer, text
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.spelling import spelled
from sim_twin.controller.script.values import Value, described

__all__ = ["STRINGS"]

_NUMBER = re.compile(
    r"""[ \t\n\v\f\r]*(?P<sign>[+-]?)(?:
    0[xX](?P<hex>[0-9a-fA-F]+)
    |(?P<decimal>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<word>inf|infinity|nan))""",
    re.VERBOSE | re.IGNORECASE,
)
_N_HEX = 16  # digits more than an integer has, before which zeros may stand


def _to_num(str: Value) -> Value:
    """Return the number that a string spells: a float where it has a decimal point, an integer where it has none."""
    found = _NUMBER.fullmatch(text(str))
    if found is None:
        raise ValueError(f"expected a string that spells a number, got {described(str)}")
    sign = -1 if found["sign"] == "-" else 1
    if found["word"] is not None:
        return sign * float(found["word"])
    if found["hex"] is not None:
        digits = found["hex"].lstrip("0")
        return _fitting(sign * int(digits[:_N_HEX] or "0", 16), str)
    number = sign * float(found["decimal"])
    is_integer = "." not in found["decimal"] and (number.is_integer() or math.isinf(number))
    return _fitting(number, str) if is_integer else _finite(number, str)


def _fitting(number: float, spelling: Value) -> int:
    if math.isinf(number) or int(number) != int32(int(number)):
        raise ValueError(f"expected an integer of 32 bits, got {described(spelling)}")
    return int(number)


def _finite(number: float, spelling: Value) -> float:
    if math.isinf(number):
        raise ValueError(f"expected a number that a float can hold, got {described(spelling)}")
    return number


def _to_str(val: Value) -> Value:
    return spelled(val)


def _str_cat(op1: Value, op2: Value) -> Value:
    return spelled(op1, op2)


def _str_at(src: Value, index: Value) -> Value:
    whole, i = text(src), integer(index)
    if not 0 <= i < len(whole):
        raise IndexError(f"expected an index from 0 and below {len(whole)}, got {i}")
    return whole[i]


def _str_empty(str: Value) -> Value:
    return not text(str)


def _str_find(src: Value, target: Value, start_from: Value = 0) -> Value:
    return text(src).find(text(target), max(0, integer(start_from)))


def _n_bytes(string: Value) -> int:
    return len(text(string))


def _str_len(str: Value) -> Value:
    return _n_bytes(str)


def _str_sub(src: Value, index: Value, len: Value = None) -> Value:
    whole, i, n_bytes = text(src), integer(index), _n_bytes(src)
    if not 0 <= i <= n_bytes:
        raise IndexError(f"expected an index from 0 to {n_bytes}, got {i}")
    n = n_bytes if len is None else integer(len)
    if n < 0:
        raise ValueError(f"expected a length of at least 0, got {n}")
    return whole[i : i + n]


STRINGS: Builtins = {
    "str_at": _str_at,
    "str_cat": _str_cat,
    "str_empty": _str_empty,
    "str_find": _str_find,
    "str_len": _str_len,
    "str_sub": _str_sub,
    "to_num": _to_num,
    "to_str": _to_str,
}
