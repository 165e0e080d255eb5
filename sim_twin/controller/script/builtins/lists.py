"""Functions of lists, and what turns lists and strings into numbers and back."""

from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.builtins.arguments import flag, integer, text, values
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.values import (
    MAX_ELEMENTS,
    ScriptStruct,
    Value,
    checked_size,
    copied,
    described,
    joined,
    text_of,
)

__all__ = ["LISTS"]

_N_BITS = 32


def _length(v: Value) -> Value:
    if type(v) is list or type(v) is str:
        return len(v)
    raise TypeError(f"expected a list or a string, got {described(v)}")


def _get_list_length(v: Value) -> Value:
    return len(values(v))


def _make_list(length: Value, initial_value: Value, capacity: Value = None) -> Value:
    """Make a list of equal values; capacity is how long it may grow, which here is as long as it likes."""
    n = integer(length)
    if n < 0 or (capacity is not None and integer(capacity) < n):
        raise ValueError(f"expected a length of 0 up to the capacity, got {n}")
    if n > MAX_ELEMENTS:
        raise ValueError(f"expected a length of at most {MAX_ELEMENTS}, got {n}")
    size = checked_size(initial_value)
    if n * (1 + size) > MAX_ELEMENTS:
        raise ValueError(f"expected at most {MAX_ELEMENTS} elements in all, got {n} times {1 + size}")
    if type(initial_value) not in (list, ScriptStruct):
        return [initial_value] * n
    return [copied(initial_value) for _ in range(n)]


def _list_append(v: Value, value: Value) -> Value:
    return [*values(v), value]


def _binary_list_to_integer(values_: Value) -> Value:
    """Return the integer whose bits are given, the lowest first."""
    bits = [flag(bit) for bit in values(values_)]
    if len(bits) > _N_BITS:
        raise ValueError(f"expected at most {_N_BITS} bits, got {len(bits)}")
    return int32(sum(1 << i for i, bit in enumerate(bits) if bit))


def _integer_to_binary_list(x: Value) -> Value:
    number = integer(x)
    return [bool(number >> i & 1) for i in range(_N_BITS)]


def _to_num(value: Value) -> Value:
    """Return the number that a string spells: an integer if it looks like one."""
    spelled = text(value).strip()
    try:
        return int32(int(spelled))
    except ValueError:
        pass
    try:
        return float(spelled)
    except ValueError:
        raise ValueError(f"expected a string that spells a number, got {described(value)}") from None


def _to_str(value: Value) -> Value:
    return text_of(value)


def _str_cat(op1: Value, op2: Value) -> Value:
    return joined(text_of(op1), text_of(op2))


def _str_at(src: Value, index: Value) -> Value:
    whole, i = text(src), integer(index)
    if not 0 <= i < len(whole):
        raise IndexError(f"expected an index from 0 and below {len(whole)}, got {i}")
    return whole[i]


def _str_empty(str_: Value) -> Value:
    return not text(str_)


def _str_find(src: Value, target: Value, start_from: Value = 0) -> Value:
    return text(src).find(text(target), max(0, integer(start_from)))


def _str_len(str_: Value) -> Value:
    return len(text(str_))


def _str_sub(src: Value, index: Value, len_: Value = None) -> Value:
    whole, i = text(src), integer(index)
    if not 0 <= i <= len(whole):
        raise IndexError(f"expected an index from 0 to {len(whole)}, got {i}")
    n = len(whole) if len_ is None else integer(len_)
    if n < 0:
        raise ValueError(f"expected a length of at least 0, got {n}")
    return whole[i : i + n]


LISTS: Builtins = {
    "binary_list_to_integer": _binary_list_to_integer,
    "get_list_length": _get_list_length,
    "integer_to_binary_list": _integer_to_binary_list,
    "length": _length,
    "list_append": _list_append,
    "make_list": _make_list,
    "str_at": _str_at,
    "str_cat": _str_cat,
    "str_empty": _str_empty,
    "str_find": _str_find,
    "str_len": _str_len,
    "str_sub": _str_sub,
    "to_num": _to_num,
    "to_str": _to_str,
}
