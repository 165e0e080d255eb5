"""What lists can do by themselves: values.append(1). They change in place; the variable keeps the list."""

from collections.abc import Callable

from sim_twin.controller.script.costs import Spend
from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.values import (
    MAX_ELEMENTS,
    ScriptStruct,
    Value,
    checked_work,
    copied_and_counted,
    described,
)

__all__ = ["call_method"]

_METHOD = 5
_N_MOVED = 256  # elements a step of the budget, where one is put in or taken out
_N_COUNTED = 3  # likewise, where they are counted or copied


def call_method(spend: Spend, owner: Value, name: str, *arguments: Value) -> Value:
    """Call owner.name(arguments); what it costs is spent."""
    if type(owner) is not list or name not in _METHODS:
        known = ", ".join(_METHODS)
        raise ScriptRuntimeError(f"{described(owner)} has no method '{name}'; lists have {known}")
    n_arguments, method = _METHODS[name]
    if len(arguments) != n_arguments:
        raise ScriptRuntimeError(f"{name}() takes {n_arguments} arguments, got {len(arguments)}")
    spend(_METHOD + len(owner) // _N_MOVED)
    return method(spend, owner, *arguments)


def _append(spend: Spend, owner: list[Value], value: Value) -> None:
    _insert(spend, owner, len(owner), value)


def _extend(spend: Spend, owner: list[Value], values: Value) -> None:
    if type(values) is not list:
        raise ScriptRuntimeError(f"extend() expects a list, got {described(values)}")
    new, n = copied_and_counted(values)
    owner.extend(new if type(new) is list else [])
    spend((n + checked_work(owner)) // _N_COUNTED)


def _insert(spend: Spend, owner: list[Value], index: Value, value: Value) -> None:
    new, n = copied_and_counted(value)
    owner.insert(_place(owner, index, "insert", last=len(owner)), new)
    spend(n // _N_COUNTED)
    if len(owner) > MAX_ELEMENTS or type(value) in (list, ScriptStruct, str):
        spend(checked_work(owner) // _N_COUNTED)


def _remove(_: Spend, owner: list[Value], index: Value) -> None:
    del owner[_place(owner, index, "remove", last=len(owner) - 1)]


def _pop(_: Spend, owner: list[Value]) -> None:
    del owner[_place(owner, len(owner) - 1, "pop", last=len(owner) - 1)]


def _slice(spend: Spend, owner: list[Value], begin: Value, end: Value) -> Value:
    first = _place(owner, begin, "slice", last=len(owner))
    part, n = copied_and_counted(owner[first : _place(owner, end, "slice", last=len(owner))])
    spend(n // _N_COUNTED)
    return part


def _place(owner: list[Value], index: Value, name: str, *, last: int) -> int:
    if type(index) is not int or not 0 <= index <= last:
        raise ScriptRuntimeError(f"{name}(): index {described(index)} is out of range, the list has {len(owner)}")
    return index


_METHODS: dict[str, tuple[int, Callable[..., Value]]] = {
    "append": (1, _append),
    "clear": (0, lambda _, owner: owner.clear()),
    "extend": (1, _extend),
    "insert": (2, _insert),
    "length": (0, lambda _, owner: len(owner)),
    "pop": (0, _pop),
    "remove": (1, _remove),
    "slice": (2, _slice),
}
