"""What lists can do by themselves: values.append(1). They change in place; the variable keeps the list."""

from collections.abc import Callable

from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.values import MAX_ELEMENTS, ScriptStruct, Value, copied, described

__all__ = ["call_method"]


def call_method(owner: Value, name: str, *arguments: Value) -> Value:
    """Call owner.name(arguments)."""
    if type(owner) is not list or name not in _METHODS:
        known = ", ".join(_METHODS)
        raise ScriptRuntimeError(f"{described(owner)} has no method '{name}'; lists have {known}")
    n_arguments, method = _METHODS[name]
    if len(arguments) != n_arguments:
        raise ScriptRuntimeError(f"{name}() takes {n_arguments} arguments, got {len(arguments)}")
    return method(owner, *arguments)


def _append(owner: list[Value], value: Value) -> None:
    _insert(owner, len(owner), value)


def _extend(owner: list[Value], values: Value) -> None:
    if type(values) is not list:
        raise ScriptRuntimeError(f"extend() expects a list, got {described(values)}")
    for value in [copied(value) for value in values]:
        _append(owner, value)


def _insert(owner: list[Value], index: Value, value: Value) -> None:
    owner.insert(_place(owner, index, "insert", last=len(owner)), copied(value))
    if len(owner) > MAX_ELEMENTS or type(value) in (list, ScriptStruct):
        copied(owner)  # refuses what has become too long


def _remove(owner: list[Value], index: Value) -> None:
    del owner[_place(owner, index, "remove", last=len(owner) - 1)]


def _pop(owner: list[Value]) -> None:
    del owner[_place(owner, len(owner) - 1, "pop", last=len(owner) - 1)]


def _slice(owner: list[Value], begin: Value, end: Value) -> Value:
    first = _place(owner, begin, "slice", last=len(owner))
    return [copied(value) for value in owner[first : _place(owner, end, "slice", last=len(owner))]]


def _place(owner: list[Value], index: Value, name: str, *, last: int) -> int:
    if type(index) is not int or not 0 <= index <= last:
        raise ScriptRuntimeError(f"{name}(): index {described(index)} is out of range, the list has {len(owner)}")
    return index


_METHODS: dict[str, tuple[int, Callable[..., Value]]] = {
    "append": (1, _append),
    "clear": (0, list.clear),
    "extend": (1, _extend),
    "insert": (2, _insert),
    "length": (0, len),
    "pop": (0, _pop),
    "remove": (1, _remove),
    "slice": (2, _slice),
}
