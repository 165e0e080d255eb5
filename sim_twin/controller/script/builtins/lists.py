"""Functions of lists, and what turns lists into numbers and back."""

from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.builtins.arguments import flag, integer, values
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.spelling import n_characters
from sim_twin.controller.script.values import (
    MAX_ELEMENTS,
    ScriptStruct,
    Value,
    checked_size,
    copied,
    described,
)

__all__ = ["LISTS"]

_N_BITS = 32


def _length(v: Value) -> Value:
    if type(v) is list:
        return len(v)
    if type(v) is str:
        return n_characters(v)
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


def _binary_list_to_integer(l: Value) -> Value:  # noqa: E741 - UR's name
    """Return the integer whose bits are given, the lowest first; bits beyond 32 are left."""
    bits = [flag(bit) for bit in values(l)[:_N_BITS]]
    return int32(sum(1 << i for i, bit in enumerate(bits) if bit))


def _integer_to_binary_list(x: Value) -> Value:
    number = integer(x)
    return [bool(number >> i & 1) for i in range(_N_BITS)]


LISTS: Builtins = {
    "binary_list_to_integer": _binary_list_to_integer,
    "get_list_length": _get_list_length,
    "integer_to_binary_list": _integer_to_binary_list,
    "length": _length,
    "list_append": _list_append,
    "make_list": _make_list,
}
