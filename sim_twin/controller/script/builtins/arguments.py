"""What a builtin may be handed. Each check says what was expected and what came; the call site adds the name."""

import math

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.values import Value, described

__all__ = ["flag", "integer", "matrix", "number", "numbers", "pose", "text", "values", "vector"]


def number(value: Value) -> float:
    """Take a number."""
    if type(value) is float or type(value) is int:
        return value
    raise TypeError(f"expected a number, got {described(value)}")


def integer(value: Value) -> int:
    """Take an integer, or a number that is whole."""
    if type(value) is int:
        return value
    if type(value) is float and value.is_integer():
        return int(value)
    raise TypeError(f"expected an integer, got {described(value)}")


def flag(value: Value) -> bool:
    """Take True or False."""
    if type(value) is bool:
        return value
    raise TypeError(f"expected True or False, got {described(value)}")


def text(value: Value) -> str:
    """Take a string."""
    if type(value) is str:
        return value
    raise TypeError(f"expected a string, got {described(value)}")


def values(value: Value) -> list[Value]:
    """Take a list."""
    if type(value) is list:
        return value
    raise TypeError(f"expected a list, got {described(value)}")


def numbers(value: Value) -> list[float]:
    """Take a list of numbers, or a pose's six."""
    if type(value) is Pose:
        return list(value)
    return [number(part) for part in values(value)]


def vector(value: Value, n: int) -> list[float]:
    """Take a list of so many finite numbers, or a pose's six."""
    found = numbers(value)
    if len(found) != n or not all(map(math.isfinite, found)):
        raise ValueError(f"expected {n} finite numbers, got {described(value)}")
    return found


def matrix(value: Value) -> list[list[float]]:
    """Take a matrix: rows of numbers, equally long."""
    rows = [numbers(row) for row in values(value)]
    if len({len(row) for row in rows}) != 1:
        raise TypeError(f"expected a matrix, rows of equal length, got {described(value)}")
    return rows


def pose(value: Value) -> Pose:
    """Take a pose."""
    if type(value) is Pose:
        return value
    raise TypeError(f"expected a pose, got {described(value)}")
