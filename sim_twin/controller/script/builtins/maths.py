"""Functions of numbers, and the linear algebra of lists."""

import math
from collections.abc import Callable

import numpy as np

from sim_twin.controller.pose import Pose, pose_inv
from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.builtins.arguments import matrix, number, numbers, values
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.spelling import n_characters
from sim_twin.controller.script.values import Value, described

__all__ = ["MATHS"]


def _of_one(function: Callable[[float], float], domain: str = "a finite number") -> Callable[[Value], Value]:
    def apply(f: Value) -> Value:
        given = number(f)
        try:
            return function(given)
        except (ValueError, ArithmeticError):
            raise ValueError(f"expected {domain}, got {described(f)}") from None

    return apply


def _atan2(x: Value, y: Value) -> Value:
    """Return the angle whose tangent is x/y: the first argument is the opposite side."""
    return math.atan2(number(x), number(y))


def _log(b: Value, f: Value) -> Value:
    base, given = number(b), number(f)
    if not (base >= 0 and base != 1 and given >= 0):
        raise ValueError(
            f"expected a base and a number of 0 or more, the base not 1, got {described(b)}, {described(f)}"
        )
    return _ln(given) / _ln(base)


def _ln(number: float) -> float:
    return math.log(number) if number else -math.inf


def _pow(base: Value, exponent: Value) -> Value:
    try:
        result = math.pow(number(base), number(exponent))
    except (ValueError, ArithmeticError):
        raise ValueError(f"expected numbers that have a power, got {described(base)}, {described(exponent)}") from None
    is_whole = type(base) is int and type(exponent) is int and exponent >= 0 and abs(result) <= 0x7FFF_FFFF
    return int(result) if is_whole else result


def _norm(a: Value) -> Value:
    """Return a list's length as a vector, or a number's distance from zero."""
    if type(a) is int or type(a) is float:
        return abs(a)
    return math.hypot(*numbers(a))


def _d2r(d: Value) -> Value:
    return math.radians(number(d))


def _r2d(r: Value) -> Value:
    return math.degrees(number(r))


def _transpose(m: Value) -> Value:
    """Turn rows into columns; an array is a row, and what has one row becomes an array."""
    if all(type(part) is not list for part in values(m)):
        return [[part] for part in numbers(m)]
    columns: list[list[Value]] = [list(column) for column in zip(*matrix(m), strict=True)]
    return columns[0] if len(columns) == 1 else [*columns]


def _inv(m: Value) -> Value:
    if isinstance(m, Pose):
        return pose_inv(m)
    try:
        return np.linalg.inv(np.array(matrix(m))).tolist()
    except np.linalg.LinAlgError as error:
        raise ValueError(f"expected a matrix that can be inverted: {error}") from error


def _size(v: Value) -> Value:
    if type(v) is str:
        return n_characters(v)
    if type(v) is not list:
        raise TypeError(f"expected a matrix, a list or a string, got {described(v)}")
    if v and type(v[0]) is list:
        return [len(v), len(v[0])]
    return len(v)


MATHS: Builtins = {
    "acos": _of_one(math.acos, "a number from -1 to 1"),
    "asin": _of_one(math.asin, "a number from -1 to 1"),
    "atan": _of_one(math.atan),
    "atan2": _atan2,
    "ceil": _of_one(lambda f: int32(math.ceil(f))),
    "cos": _of_one(math.cos),
    "d2r": _d2r,
    "floor": _of_one(lambda f: int32(math.floor(f))),
    "inv": _inv,
    "log": _log,
    "norm": _norm,
    "pow": _pow,
    "r2d": _r2d,
    "sin": _of_one(math.sin),
    "size": _size,
    "sqrt": _of_one(math.sqrt, "a number of 0 or more"),
    "tan": _of_one(math.tan),
    "transpose": _transpose,
}
