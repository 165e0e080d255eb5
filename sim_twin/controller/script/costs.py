"""What code costs a slice, in steps of some 0.1 µs of Python: counted, so that every run is the same.

A slice's budget is a bound on time without a clock. It holds as far as nothing takes much longer than it costs: a node
of an expression one step, what goes through lists and strings by their length, a builtin what it was measured to take.
"""

from collections.abc import Callable, Sequence

import msgspec

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.syntax import Assign, Critical, Definition, If, Name, Statement, ThreadAction, While
from sim_twin.controller.script.values import ScriptStruct, Value, copied_and_counted

__all__ = [
    "BUILTIN",
    "CALL",
    "NUMBERS",
    "WRITING",
    "Spend",
    "copier",
    "length_cost",
    "round_cost",
    "statement_cost",
    "text_cost",
]

Spend = Callable[[int], None]

CALL = 8
"""Of a function of the program, beside what it executes."""
BUILTIN = 20
"""Of a builtin that nobody named a cost of."""
_N_COPIED = 2  # elements a step
_N_CHARACTERS = 128  # a step
_PART = 12  # a pose, a string, a list or a struct within another
_SWITCH = 6  # where a thread waits for others, beside its turn
_PLACE = 6  # where a part of a variable is assigned
NUMBERS = frozenset({bool, int, float})
_WRITTEN, _MIXED = 3, 6  # a number as text, in a list of numbers and in any other
_POSE = 26
_LONG, _DIGITS = 1e15, 160  # from where a float with six decimals is long, and how long it takes to write
_N_WRITTEN = 400  # numbers of a list of which any can be that long: more have no place in to_str
WRITING = frozenset({"popup", "socket_send_line", "socket_send_string", "str_cat", "textmsg", "to_str"})
"""Functions that write their arguments out, whatever those are."""


def statement_cost(node: Statement) -> int:
    """Return what a statement costs, without its blocks and what it calls; an if counts all its tests."""
    if isinstance(node, While):
        return 1
    if isinstance(node, If):
        return 1 + sum(_n_nodes(test) for _, test, _ in node.branches)
    if isinstance(node, Critical | ThreadAction):
        return _SWITCH + _n_nodes(node)
    is_part = isinstance(node, Assign) and not isinstance(node.target, Name)
    return _n_nodes(node) + (_PLACE if is_part else 0)


def round_cost(node: While) -> int:
    """Return what a loop's round costs without its block."""
    return 1 + _n_nodes(node.condition)


def copier(spend: Spend) -> Callable[[Value], Value]:
    """Return `values.copied` for values whose copies cost."""

    def copied(value: Value) -> Value:
        if type(value) is list or type(value) is ScriptStruct:
            copy, n = copied_and_counted(value)
            spend(1 + n // _N_COPIED)
            return copy
        return value

    return copied


def length_cost(value: Value) -> int:
    """Return what it costs to go through a string, or to write out all that a list or a struct has."""
    if type(value) is str:
        return len(value) // _N_CHARACTERS
    if type(value) is list:
        return len(value) // _N_COPIED + sum(_PART + length_cost(part) for part in value if type(part) not in NUMBERS)
    return sum(_PART + length_cost(part) for part in value.members.values()) if type(value) is ScriptStruct else 0


def text_cost(value: Value) -> int:
    """Return what it costs to write a value out, beside going through it; a number among other things takes longer."""
    if type(value) is float:
        return _digit_cost((value,))
    if type(value) is list:
        others = [part for part in value if type(part) not in NUMBERS]
        written = (_MIXED if others else _WRITTEN) * len(value) + _digit_cost(value[:_N_WRITTEN])
        return written + sum(_PART + text_cost(part) for part in others)
    if type(value) is ScriptStruct:
        return sum(_MIXED + _PART + text_cost(part) for part in value.members.values())
    return _POSE + _digit_cost(value) if isinstance(value, Pose) else 0


def _digit_cost(values: Sequence[Value]) -> int:
    """Return what the long numbers among some cost; three make a string as long as it may be."""
    n_long = sum(type(value) is float and not -_LONG < value < _LONG for value in values)
    return _DIGITS * min(n_long, 3)


def _n_nodes(node: object) -> int:
    if isinstance(node, tuple):
        return sum(map(_n_nodes, node))
    if isinstance(node, msgspec.Struct) and not isinstance(node, Definition):
        return 1 + sum(_n_nodes(getattr(node, part)) for part in node.__struct_fields__)
    return 0
