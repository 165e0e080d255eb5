"""What a URScript variable can hold, and how it is tested, copied, indexed and printed."""

from collections.abc import Iterable, Sequence
from typing import TypeAlias, Union

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.errors import ScriptRuntimeError

__all__ = [
    "MAX_CHARACTERS",
    "MAX_ELEMENTS",
    "ScriptStruct",
    "Value",
    "checked_size",
    "checked_work",
    "copied",
    "copied_and_counted",
    "described",
    "item",
    "joined",
    "member",
    "shown",
    "stored",
    "stored_member",
    "text_of",
    "truth",
]

Value: TypeAlias = Union[bool, int, float, str, Pose, "list[Value]", "ScriptStruct", None]


MAX_ELEMENTS = 10_000
"""Of a list or a struct in all, those of its parts included; a string counts once more for every 1,024 characters."""
MAX_CHARACTERS = 65_536
_N_CHARACTERS = 1024  # that count as one more element
_CONTAINER = 12  # elements that a list or a struct by itself takes as long as
_N_SHOWN = 40  # characters of a value in a message


class ScriptStruct:
    """Named members, fixed when the struct is made."""

    __slots__ = ("members",)

    def __init__(self, members: dict[str, Value]) -> None:
        self.members = members

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ScriptStruct) and self.members == other.members

    def __repr__(self) -> str:
        return f"ScriptStruct({self.members!r})"

    __hash__ = None  # pyright: ignore[reportAssignmentType] - it changes


def copied(value: Value) -> Value:
    """Return a value that shares nothing with this one: URScript assigns and passes by value.

    What grows passes here, so here is where a list of lists that doubles at every turn comes to its end.
    """
    return copied_and_counted(value)[0]


def copied_and_counted(value: Value) -> tuple[Value, int]:
    """Return the copy and how much work it was: its elements in all, a list or struct being as much as some.

    Raises:
        ScriptRuntimeError: there are too many.
    """
    room = [MAX_ELEMENTS, 0]
    return _copied(value, room), MAX_ELEMENTS - room[0] + room[1]


def checked_size(value: Value) -> int:
    """Return how many elements a value has in all, after something was put into it.

    Raises:
        ScriptRuntimeError: there are too many.
    """
    room = [MAX_ELEMENTS, 0]
    _count(value, room)
    return MAX_ELEMENTS - room[0]


def checked_work(value: Value) -> int:
    """Return how much work it is to go through a value, as `copied_and_counted` does; raises as `checked_size`."""
    room = [MAX_ELEMENTS, 0]
    _count(value, room)
    return MAX_ELEMENTS - room[0] + room[1]


def _take(n: int, room: list[int]) -> None:
    """Take elements off the room, which stands first, and add a container's work to the second."""
    room[0] -= n
    room[1] += _CONTAINER
    if room[0] < 0:
        raise ScriptRuntimeError(
            f"the list is too long, expected at most {MAX_ELEMENTS} elements in all, "
            f"{_N_CHARACTERS} characters of a string being one more"
        )


def _copied(value: Value, room: list[int]) -> Value:
    if type(value) is list:
        _take(len(value), room)
        return [part if type(part) in _FLAT else _copied(part, room) for part in value]
    if type(value) is ScriptStruct:
        _take(len(value.members), room)
        return ScriptStruct({name: _copied(part, room) for name, part in value.members.items()})
    if type(value) is str:
        _take(len(value) // _N_CHARACTERS, room)
    return value


def _count(value: Value, room: list[int]) -> None:
    if type(value) is str:
        _take(len(value) // _N_CHARACTERS, room)
        return
    parts = value.members.values() if isinstance(value, ScriptStruct) else value
    if not isinstance(parts, str | Pose | int | float | None):
        _take(len(parts), room)
        for part in parts:
            if type(part) not in _FLAT:
                _count(part, room)


def joined(first: str, second: str) -> str:
    """Return two strings as one."""
    if len(first) + len(second) > MAX_CHARACTERS:
        raise _too_long()
    return first + second


def truth(value: Value) -> bool:
    """Return whether a condition holds: a bool, a number that is not zero, or a string that is not empty."""
    if value is True or value is False:
        return value
    if type(value) is int or type(value) is float:
        return value != 0
    if type(value) is str:
        return value != ""
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
    """Return what textmsg, popups and sockets print: six significant digits, poses as p[...].

    Raises:
        ScriptRuntimeError: it is longer than a string may be.
    """
    pieces: list[str] = []
    if _write(value, pieces, MAX_CHARACTERS) < 0:
        raise _too_long()
    return "".join(pieces)


def _write(value: Value, pieces: list[str], room: int) -> int:
    """Write a value piece by piece until the room is used up; return what is left of it, below zero if too little."""
    if type(value) is list and not all(type(part) in _FLAT for part in value):
        return _write_all("[", (("", part) for part in value), "]", pieces, room)
    if type(value) is ScriptStruct:
        return _write_all("struct(", ((f"{name}=", part) for name, part in value.members.items()), ")", pieces, room)
    text = f"[{', '.join(map(_plain, value))}]" if type(value) is list else _plain(value)
    pieces.append(text)
    return room - len(text)


def _write_all(begin: str, parts: Iterable[tuple[str, Value]], end: str, pieces: list[str], room: int) -> int:
    room -= len(begin) + len(end)
    between = begin
    for name, part in parts:
        pieces.append(between + name)
        room = _write(part, pieces, room - (len(name) if between is begin else 2 + len(name)))
        if room < 0:
            return room
        between = ", "
    pieces.append(end if between == ", " else begin + end)
    return room


def _plain(value: Value) -> str:
    """Write a value that is neither a list nor a struct."""
    if type(value) is float:
        return f"{value:g}"
    if type(value) is Pose:
        return f"p[{', '.join(f'{part:g}' for part in value)}]"
    return str(value)


def _too_long() -> ScriptRuntimeError:
    return ScriptRuntimeError(f"the string is too long, expected at most {MAX_CHARACTERS} characters")


def shown(text: str) -> str:
    """Return a script's string, a character for each byte, as people read it."""
    return text if text.isascii() else text.encode("latin-1", "replace").decode("utf-8", "replace")


def described(value: Value) -> str:
    """Say in a message what a value is."""
    if value is None:
        return "nothing"
    if type(value) is str:
        return f"the string '{shown(value[:_N_SHOWN])}'"
    pieces: list[str] = []
    _write(value, pieces, _N_SHOWN)
    return f"the {_KINDS.get(type(value), 'value')} {''.join(pieces)[:_N_SHOWN]}"


_FLAT = frozenset({bool, int, float, Pose, type(None)})
_KINDS = {bool: "bool", int: "integer", float: "number", list: "list", Pose: "pose", ScriptStruct: "value"}


def _checked(index: Value, container: Sequence[Value]) -> int:
    if type(index) is float and index.is_integer():
        index = int(index)  # registers and sums hand over 2.0 where 2 is meant
    if type(index) is not int:
        raise ScriptRuntimeError(f"expected an integer as index, got {described(index)}")
    if not 0 <= index < len(container):
        raise ScriptRuntimeError(f"index {index} is out of range, expected 0 to {len(container) - 1}")
    return index
