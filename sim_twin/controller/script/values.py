"""What a URScript variable can hold, and how it is tested, copied, indexed and printed."""

from collections.abc import Sequence
from typing import TypeAlias, Union

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.errors import ScriptRuntimeError

__all__ = [
    "MAX_ELEMENTS",
    "ScriptStruct",
    "Value",
    "copied",
    "described",
    "item",
    "joined",
    "member",
    "stored",
    "stored_member",
    "text_of",
    "truth",
]

Value: TypeAlias = Union[bool, int, float, str, Pose, "list[Value]", "ScriptStruct", None]


MAX_ELEMENTS = 10_000
_MAX_CHARACTERS = 65_536


class ScriptStruct:
    """Named members, fixed when the struct is made."""

    __slots__ = ("members",)

    def __init__(self, members: dict[str, Value]) -> None:
        self.members = members

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ScriptStruct) and self.members == other.members

    __hash__ = None  # pyright: ignore[reportAssignmentType] - it changes


def copied(value: Value) -> Value:
    """Return a value that shares nothing with this one: URScript assigns and passes by value.

    Everything that grows passes here, so here is where a list of lists that doubles at every turn comes to its end.
    """
    if type(value) is list or type(value) is ScriptStruct:
        return _copied(value, [MAX_ELEMENTS])
    return value


def _copied(value: Value, room: list[int]) -> Value:
    if type(value) is list:
        room[0] -= len(value)
        if room[0] < 0:
            raise ScriptRuntimeError(f"the list is too long, expected at most {MAX_ELEMENTS} elements in all")
        return [_copied(part, room) if type(part) in (list, ScriptStruct) else part for part in value]
    if type(value) is ScriptStruct:
        return ScriptStruct({name: _copied(part, room) for name, part in value.members.items()})
    return value


def joined(first: str, second: str) -> str:
    """Return two strings as one."""
    if len(first) + len(second) > _MAX_CHARACTERS:
        raise ScriptRuntimeError(f"the string is too long, expected at most {_MAX_CHARACTERS} characters")
    return first + second


def truth(value: Value) -> bool:
    """Return whether a condition holds: a bool, or a number that is not zero."""
    if value is True or value is False:
        return value
    if type(value) is int or type(value) is float:
        return value != 0
    raise ScriptRuntimeError(f"expected True or False, got {described(value)}; compare it with something")


def item(container: Value, *indexes: Value) -> Value:
    """Return container[i], or container[i, j] of a matrix."""
    for index in indexes:
        if type(container) is list or type(container) is Pose or type(container) is str:
            container = container[_checked(index, container)]
        else:
            raise ScriptRuntimeError(f"expected a list or a pose before [ ], got {described(container)}")
    return container


def stored(container: Value, index: Value, value: Value) -> Value:
    """Return the container with one element replaced; a list is changed in place, a pose made anew."""
    if type(container) is list:
        container[_checked(index, container)] = value
        return container
    if type(container) is Pose:
        if type(value) is not float and type(value) is not int:
            raise ScriptRuntimeError(f"expected a number as element of a pose, got {described(value)}")
        at = _checked(index, container)
        return container._replace(**{Pose._fields[at]: float(value)})
    raise ScriptRuntimeError(f"expected a list or a pose before [ ], got {described(container)}")


def member(owner: Value, name: str) -> Value:
    """Return a struct's member."""
    if type(owner) is not ScriptStruct:
        raise ScriptRuntimeError(f"expected a struct before .{name}, got {described(owner)}")
    if name not in owner.members:
        raise ScriptRuntimeError(f"the struct has no member '{name}', it has {', '.join(owner.members)}")
    return owner.members[name]


def stored_member(owner: Value, name: str, value: Value) -> Value:
    """Return the struct with one member replaced, in place."""
    member(owner, name)
    if type(owner) is ScriptStruct:
        owner.members[name] = value
    return owner


def text_of(value: Value) -> str:
    """Return what to_str and textmsg print: six significant digits, poses as p[...]."""
    if value is None:
        return "None"
    if type(value) is float:
        return f"{value:g}"
    if type(value) is list:
        return f"[{', '.join(map(text_of, value))}]"
    if type(value) is Pose:
        return f"p[{', '.join(map(text_of, value))}]"
    if type(value) is ScriptStruct:
        return f"struct({', '.join(f'{name}={text_of(part)}' for name, part in value.members.items())})"
    return str(value)


def described(value: Value) -> str:
    """Say in a message what a value is."""
    if value is None:
        return "nothing"
    if type(value) is str:
        return f"the string '{value[:40]}'"
    shown = text_of(value)
    return f"the {_KINDS.get(type(value), 'value')} {shown[:40]}"


_KINDS = {bool: "bool", int: "integer", float: "number", list: "list", Pose: "pose", ScriptStruct: "value"}


def _checked(index: Value, container: Sequence[Value]) -> int:
    if type(index) is float and index.is_integer():
        index = int(index)  # registers and sums hand over 2.0 where 2 is meant
    if type(index) is not int:
        raise ScriptRuntimeError(f"expected an integer as index, got {described(index)}")
    if not 0 <= index < len(container):
        raise ScriptRuntimeError(f"index {index} is out of range, expected 0 to {len(container) - 1}")
    return index
