"""A plain tree to a Struct; what does not fit is told by its place, what was expected there and what came."""

import difflib
import re
from typing import TypeVar

import msgspec
from msgspec import inspect

from config.errors import ConfigError
from config.yaml_text import Tree, join, shown

__all__ = ["decode", "nearest"]

S = TypeVar("S", bound=msgspec.Struct)

STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]")
AT = " - at `$"
UNKNOWN = re.compile(r"Object contains unknown field `(?P<key>.*)`", re.DOTALL)
END = r"\Z"
MISSING = re.compile(r"Object missing required field `(?P<key>.*)`")


def decode(tree: Tree, kind: type[S], file: str) -> S:
    """Return the tree as a Struct of that kind.

    Raises:
        ConfigError: an unknown or missing key, a wrong type or a value out of range.
    """
    try:
        return msgspec.convert(tree, kind)
    except msgspec.ValidationError as error:
        raise _explain(str(error), tree, kind, file) from error


def nearest(name: str, known: list[str] | tuple[str, ...]) -> str:
    """Return a remark that names the nearest of the known names, empty if none is near."""
    near = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]}?)" if near else ""


def _explain(message: str, tree: Tree, kind: type[msgspec.Struct], file: str) -> ConfigError:
    """Return a validation message of msgspec in our words."""
    what, path = _split(message, tree)
    where, value, asked = _follow(path, tree, inspect.type_info(kind))
    if unknown := UNKNOWN.fullmatch(what):
        known = [field.name for field in _struct(asked).fields]
        got = f"the unknown key {shown(unknown['key'])}{nearest(unknown['key'], known)}"
        return ConfigError(file, where, f"the keys {', '.join(known)}", got)
    if missing := MISSING.fullmatch(what):
        field = next(field for field in _struct(asked).fields if field.name == missing["key"])
        return ConfigError(file, join(where, field.name), _expected(field.type), "no such key")
    return ConfigError(file, where, _expected(asked), shown(value))


def _split(message: str, tree: Tree) -> tuple[str, str]:
    """Return what is wrong and the path to it; keys and values in the message may look like a path themselves."""
    at_root = UNKNOWN.fullmatch(message)
    if at_root and isinstance(tree, dict) and at_root["key"] in tree:
        return message, ""
    what, _, path = message.rpartition(AT) if AT in message else (message, "", "`")
    return what, path.removesuffix("`")


def _follow(path: str, tree: Tree, asked: inspect.Type) -> tuple[str, Tree, inspect.Type]:
    """Walk tree and type along a path of msgspec's and return the place in our notation, value and type there."""
    where = ""
    for key, index in STEP.findall(path):
        if key:
            assert isinstance(tree, dict)
            asked = next(field.type for field in _struct(asked).fields if field.name == key)
            where, tree = join(where, key), tree[key]
        else:
            assert isinstance(tree, list)
            asked = _item(asked, int(index))
            where, tree = join(where, int(index)), tree[int(index)]
    return where, tree, asked


def _struct(asked: inspect.Type) -> inspect.StructType:
    if isinstance(asked, inspect.UnionType):
        asked = next(member for member in asked.types if not isinstance(member, inspect.NoneType))
    assert isinstance(asked, inspect.StructType)
    return asked


def _item(asked: inspect.Type, index: int) -> inspect.Type:
    if isinstance(asked, inspect.UnionType):
        asked = next(m for m in asked.types if isinstance(m, inspect.TupleType | inspect.VarTupleType))
    if isinstance(asked, inspect.TupleType):
        return asked.item_types[index]
    assert isinstance(asked, inspect.VarTupleType)
    return asked.item_type


def _expected(asked: inspect.Type) -> str:
    """Return in words what a type admits."""
    match asked:
        case inspect.UnionType():
            return " or ".join(_expected(member) for member in asked.types)
        case inspect.EnumType():
            return f"one of {', '.join(str(member.value) for member in asked.cls)}"
        case inspect.LiteralType():
            return f"one of {', '.join(str(value) for value in asked.values)}"
        case inspect.TupleType():
            return f"a list of {len(asked.item_types)}, each {_expected(asked.item_types[0])}"
        case inspect.VarTupleType():
            return f"a list{_size(asked, 'entries')}, each {_expected(asked.item_type)}"
        case _:
            return _expected_plain(asked)


def _expected_plain(asked: inspect.Type) -> str:
    match asked:
        case inspect.NoneType():
            return "nothing"
        case inspect.BoolType():
            return "true or false"
        case inspect.IntType():
            return f"a whole number{_range(asked)}"
        case inspect.FloatType():
            return f"a number{_range(asked)}"
        case inspect.StrType():
            form = "" if asked.pattern is None else f" like {asked.pattern.removeprefix('^').removesuffix(END)}"
            return f"text{_size(asked, 'characters')}{form}"
        case _:
            return "a mapping"


def _range(asked: inspect.IntType | inspect.FloatType) -> str:
    bounds = [("above", asked.gt), ("from", asked.ge), ("below", asked.lt), ("up to", asked.le)]
    return "".join(f" {word} {limit:g}" for word, limit in bounds if limit is not None)


def _size(asked: inspect.StrType | inspect.VarTupleType, unit: str) -> str:
    bounds = [("at least", asked.min_length), ("at most", asked.max_length)]
    words = " and".join(f" {word} {limit}" for word, limit in bounds if limit)
    return f" of{words} {unit}" if words else ""
