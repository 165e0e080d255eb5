"""URScript's operators on numbers, strings, lists and matrices; integers have 32 bits, division gives a float.

Poses have no operators on a robot either: pose_add, pose_sub and pose_trans are what they have.
"""

import math
import operator
from collections.abc import Callable

from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.values import Value, described, joined

__all__ = ["BINARY", "UNARY", "int32"]

Number = int | float


def int32(number: int) -> int:
    """Wrap an integer to 32 bits, two's complement."""
    return (number + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000


def _divide(a: Number, b: Number) -> float:
    if b == 0:
        raise ScriptRuntimeError("division by zero")
    return a / b


def _remainder(a: Number, b: Number) -> Number:
    if b == 0:
        raise ScriptRuntimeError("division by zero in %")
    rest = math.fmod(a, b) if math.isfinite(a) else math.nan
    return int(rest) if type(a) is int and type(b) is int else rest


def _arithmetic(symbol: str, on_numbers: Callable[[Number, Number], Number]) -> Callable[[Value, Value], Value]:
    """Spread an operator on numbers over lists, number by number."""

    def apply(a: Value, b: Value) -> Value:
        type_a, type_b = type(a), type(b)
        if (type_a is float or type_a is int) and (type_b is float or type_b is int):
            result = on_numbers(a, b)  # pyright: ignore[reportArgumentType] - type() narrows two names at once
            if type(result) is int and not -0x8000_0000 <= result <= 0x7FFF_FFFF:
                return int32(result)
            return result
        if type(a) is list or type(b) is list:
            return _on_lists(symbol, apply, a, b)
        if type(a) is str and type(b) is str and symbol == "+":
            return joined(a, b)
        raise ScriptRuntimeError(f"{described(a)} {symbol} {described(b)} is not defined{_hint(a, b)}")

    return apply


def _on_lists(symbol: str, apply: Callable[[Value, Value], Value], a: Value, b: Value) -> Value:
    """Apply an operator where at least one side is a list."""
    if type(a) is not list:
        return [apply(a, part) for part in b] if type(b) is list else None
    if type(b) is not list:
        return [apply(part, b) for part in a]
    if symbol == "*" and a and type(a[0]) is list:
        return _matrix_product(a, b, apply)
    if len(a) != len(b):
        raise ScriptRuntimeError(f"list {symbol} list needs equal lengths, got {len(a)} and {len(b)}")
    return [apply(x, y) for x, y in zip(a, b, strict=True)]


def _matrix_product(a: list[Value], b: list[Value], multiply: Callable[[Value, Value], Value]) -> list[Value]:
    """Return the product of a matrix with a matrix or an array."""
    width = len(b)
    if any(type(row) is not list or len(row) != width for row in a):
        raise ScriptRuntimeError(f"matrix * needs as many columns on the left as rows on the right, which are {width}")
    rows = [row for row in a if type(row) is list]
    if b and type(b[0]) is list:
        columns = [[row[j] for row in b if type(row) is list] for j in range(len(b[0]))]
        if any(len(column) != width for column in columns):
            raise ScriptRuntimeError("matrix * needs rows of equal length on the right")
        return [[_dot(row, column, multiply) for column in columns] for row in rows]
    return [_dot(row, b, multiply) for row in rows]


def _dot(a: list[Value], b: list[Value], multiply: Callable[[Value, Value], Value]) -> Value:
    add = BINARY["+"]
    total: Value = 0
    for x, y in zip(a, b, strict=True):
        total = add(total, multiply(x, y))
    return total


def _hint(a: Value, b: Value) -> str:
    if type(a) is str or type(b) is str:
        return "; join with str_cat"
    if isinstance(a, tuple) or isinstance(b, tuple):
        return "; use pose_add, pose_sub or pose_trans"
    return ""


def _comparison(symbol: str, on_numbers: Callable[[Number, Number], bool]) -> Callable[[Value, Value], Value]:
    def apply(a: Value, b: Value) -> Value:
        type_a, type_b = type(a), type(b)
        if (type_a is float or type_a is int) and (type_b is float or type_b is int):
            return on_numbers(a, b)  # pyright: ignore[reportArgumentType] - as above
        raise ScriptRuntimeError(f"expected numbers around {symbol}, got {described(a)} and {described(b)}")

    return apply


def _negate(value: Value) -> Value:
    if type(value) is int:
        return int32(-value)
    if type(value) is float:
        return -value
    if type(value) is list:
        return [_negate(part) for part in value]
    raise ScriptRuntimeError(f"expected a number after -, got {described(value)}")


def _keep(value: Value) -> Value:
    if type(value) in (int, float, list):
        return value
    raise ScriptRuntimeError(f"expected a number after +, got {described(value)}")


BINARY: dict[str, Callable[[Value, Value], Value]] = {
    "+": _arithmetic("+", operator.add),
    "-": _arithmetic("-", operator.sub),
    "*": _arithmetic("*", operator.mul),
    "/": _arithmetic("/", _divide),
    "%": _arithmetic("%", _remainder),
    "==": operator.eq,
    "!=": operator.ne,
    "<": _comparison("<", operator.lt),
    "<=": _comparison("<=", operator.le),
    ">": _comparison(">", operator.gt),
    ">=": _comparison(">=", operator.ge),
}

UNARY: dict[str, Callable[[Value], Value]] = {"-": _negate, "+": _keep}
