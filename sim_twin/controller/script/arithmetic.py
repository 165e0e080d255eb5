"""URScript's operators on numbers, strings, lists and matrices; integers have 32 bits, division gives a float.

Poses have no operators on a robot either: pose_add, pose_sub and pose_trans are what they have.
"""

import math
import operator
from collections.abc import Callable
from typing import TypeAlias

from sim_twin.controller.script.costs import Spend, length_cost
from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.values import ScriptStruct, Value, checked_work, described, joined

__all__ = ["BINARY", "PLAIN", "UNARY", "binary_operators", "int32", "unary_operators"]

Number = int | float
Operator: TypeAlias = Callable[[Value, Value], Value]

_PAIR = 3
"""Steps of the budget for each element of a list operation."""
_PRODUCT = 6
"""Likewise for each pair of elements that a matrix product multiplies."""
_LONG = (list, ScriptStruct, str)


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


def _arithmetic(symbol: str, on_numbers: Callable[[Number, Number], Number], spend: Spend) -> Operator:
    """Spread an operator on numbers over lists, number by number."""

    def apply(a: Value, b: Value) -> Value:
        type_a, type_b = type(a), type(b)
        if (type_a is float or type_a is int) and (type_b is float or type_b is int):
            result = on_numbers(a, b)  # pyright: ignore[reportArgumentType] - type() narrows two names at once
            if type(result) is int and not -0x8000_0000 <= result <= 0x7FFF_FFFF:
                return int32(result)
            return result
        if type(a) is list or type(b) is list:
            spend(_PAIR * max(len(side) for side in (a, b) if type(side) is list))
            return _on_lists(symbol, apply, a, b, spend)
        if type(a) is str and type(b) is str and symbol == "+":
            spend(length_cost(a) + length_cost(b))
            return joined(a, b)
        raise ScriptRuntimeError(f"{described(a)} {symbol} {described(b)} is not defined{_hint(a, b)}")

    return apply


def _on_lists(symbol: str, apply: Operator, a: Value, b: Value, spend: Spend) -> Value:
    """Apply an operator where at least one side is a list."""
    if type(a) is not list:
        return [apply(a, part) for part in b] if type(b) is list else None
    if type(b) is not list:
        return [apply(part, b) for part in a]
    if symbol == "*" and a and type(a[0]) is list:
        return _matrix_product(a, b, apply, spend)
    if len(a) != len(b):
        raise ScriptRuntimeError(f"list {symbol} list needs equal lengths, got {len(a)} and {len(b)}")
    return [apply(x, y) for x, y in zip(a, b, strict=True)]


def _matrix_product(a: list[Value], b: list[Value], multiply: Operator, spend: Spend) -> list[Value]:
    """Return the product of a matrix with a matrix or an array."""
    width = len(b)
    if any(type(row) is not list or len(row) != width for row in a):
        raise ScriptRuntimeError(f"matrix * needs as many columns on the left as rows on the right, which are {width}")
    rows = [row for row in a if type(row) is list]
    if b and type(b[0]) is list:
        spend(_PRODUCT * len(a) * max(1, width) * len(b[0]))
        columns = [[row[j] for row in b if type(row) is list and j < len(row)] for j in range(len(b[0]))]
        if any(type(row) is not list or len(row) != len(columns) for row in b):
            raise ScriptRuntimeError("matrix * needs rows of equal length on the right")
        return [[_dot(row, column, multiply) for column in columns] for row in rows]
    spend(_PRODUCT * len(a) * width)
    return [_dot(row, b, multiply) for row in rows]


def _dot(a: list[Value], b: list[Value], multiply: Operator) -> Value:
    add = BINARY["+"]
    total: Value = 0
    for x, y in zip(a, b, strict=True):
        if type(x) is float and type(y) is float and (type(total) is float or type(total) is int):
            total += x * y
        else:
            total = add(total, multiply(x, y))
    return total


def _hint(a: Value, b: Value) -> str:
    if type(a) is str or type(b) is str:
        return "; join with str_cat"
    if isinstance(a, tuple) or isinstance(b, tuple):
        return "; use pose_add, pose_sub or pose_trans"
    return ""


def _comparison(symbol: str, on_numbers: Callable[[Number, Number], bool]) -> Operator:
    def apply(a: Value, b: Value) -> Value:
        type_a, type_b = type(a), type(b)
        if (type_a is float or type_a is int) and (type_b is float or type_b is int):
            return on_numbers(a, b)  # pyright: ignore[reportArgumentType] - as above
        raise ScriptRuntimeError(f"expected numbers around {symbol}, got {described(a)} and {described(b)}")

    return apply


def _equality(on_values: Operator, spend: Spend) -> Operator:
    def apply(a: Value, b: Value) -> Value:
        if type(a) is type(b) and type(a) in _LONG:
            spend(length_cost(a) + checked_work(a))
        return on_values(a, b)

    return apply


def _negation(spend: Spend) -> Callable[[Value], Value]:
    def negate(value: Value) -> Value:
        if type(value) is int:
            return int32(-value)
        if type(value) is float:
            return -value
        if type(value) is list:
            spend(_PAIR * len(value))
            return [negate(part) for part in value]
        raise ScriptRuntimeError(f"expected a number after -, got {described(value)}")

    return negate


def _keep(value: Value) -> Value:
    if type(value) in (int, float, list):
        return value
    raise ScriptRuntimeError(f"expected a number after +, got {described(value)}")


def binary_operators(spend: Spend) -> dict[str, Operator]:
    """Return the operators between two operands; what they do to lists and strings is spent."""
    return {
        "+": _arithmetic("+", operator.add, spend),
        "-": _arithmetic("-", operator.sub, spend),
        "*": _arithmetic("*", operator.mul, spend),
        "/": _arithmetic("/", _divide, spend),
        "%": _arithmetic("%", _remainder, spend),
        "==": _equality(operator.eq, spend),
        "!=": _equality(operator.ne, spend),
        "<": _comparison("<", operator.lt),
        "<=": _comparison("<=", operator.le),
        ">": _comparison(">", operator.gt),
        ">=": _comparison(">=", operator.ge),
    }


def unary_operators(spend: Spend) -> dict[str, Callable[[Value], Value]]:
    """Return the operators before an operand."""
    return {"-": _negation(spend), "+": _keep}


def _free(_: int) -> None:
    return None


PLAIN: dict[str, Operator] = {"==": operator.eq, "!=": operator.ne}
"""Fit where one side is a constant, which no list is."""
BINARY = binary_operators(_free)
"""For whoever has no budget."""
UNARY = unary_operators(_free)
