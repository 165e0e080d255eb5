"""YAML text to a plain tree and back: a small, strict part of YAML that cannot surprise or be abused.

Mappings, lists and scalars only: no tags, anchors, aliases or second documents; keys are text and come once; numbers
are decimal and finite. `yes`, `on` and `1:30` are text. Everything else is a ConfigError that names its place.
"""

import math
import re
from collections.abc import Iterator

import yaml
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from config.errors import ConfigError

__all__ = ["MAX_DEPTH", "Tree", "dump_yaml", "join", "parse_yaml", "shown"]

Tree = None | bool | int | float | str | list["Tree"] | dict[str, "Tree"]

MAX_DEPTH = 16
MAX_DIGITS = 15
"""More than a float holds exactly."""
MAX_SHOWN = 60
NULLS = ("", "~", "null", "Null", "NULL")
BOOLEANS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
INTEGER = re.compile(r"[-+]?[0-9]+", re.ASCII)
DECIMAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", re.ASCII)


def parse_yaml(text: str, file: str) -> Tree:
    """Return the tree of a YAML text.

    Args:
        text: the file's content.
        file: what errors call the file.

    Raises:
        ConfigError: not YAML, or YAML outside the part that is read here.
    """
    try:
        return _Builder(file, yaml.parse(text, Loader=yaml.SafeLoader)).document()
    except yaml.YAMLError as error:
        raise _syntax_error(error, file) from error
    except (ValueError, OverflowError) as error:  # PyYAML on impossible escapes and directives
        raise ConfigError(file, "", "YAML", f"a character or directive it cannot have ({error})") from error


def dump_yaml(tree: Tree) -> str:
    """Return YAML text that parse_yaml reads back to an equal tree; tuples become lists."""
    return yaml.dump(tree, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)


def join(where: str, key: str | int) -> str:
    """Return the path of a key or an index below a path, as in `boxes[1].lid.output`."""
    if isinstance(key, int):
        return f"{where}[{key}]"
    return f"{where}.{key}" if where else key


def shown(value: object) -> str:
    """Return a value as an error may show it: short, on one line, printable."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else repr(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 3]}..."


class _Builder:
    """Builds a tree from a stream of YAML events."""

    def __init__(self, file: str, events: Iterator[Event]) -> None:
        self._file = file
        self._events = events

    def document(self) -> Tree:
        """Read the whole stream, which must hold one document."""
        next(self._events)  # stream start
        start = next(self._events)
        if isinstance(start, StreamEndEvent):
            raise ConfigError(self._file, "", "a mapping", "an empty file")
        tree = self._node(next(self._events), "", 0)
        next(self._events)  # document end
        extra = next(self._events)
        if isinstance(extra, DocumentStartEvent):
            raise ConfigError(self._file, "", "one document", f"a second one{_line(extra)}")
        return tree

    def _node(self, event: Event, where: str, depth: int) -> Tree:
        if isinstance(event, AliasEvent) or getattr(event, "anchor", None) is not None:
            raise ConfigError(self._file, where, "a plain value", f"an anchor or alias{_line(event)}")
        if (tag := getattr(event, "tag", None)) is not None:
            raise ConfigError(self._file, where, "a plain value", f"the tag {shown(tag)}{_line(event)}")
        if depth >= MAX_DEPTH:
            raise ConfigError(self._file, where, f"at most {MAX_DEPTH} levels", f"more{_line(event)}")
        if isinstance(event, MappingStartEvent):
            return self._mapping(where, depth)
        if isinstance(event, SequenceStartEvent):
            return self._list(where, depth)
        assert isinstance(event, ScalarEvent)
        return self._scalar(event, where)

    def _mapping(self, where: str, depth: int) -> dict[str, Tree]:
        tree: dict[str, Tree] = {}
        while not isinstance(event := next(self._events), MappingEndEvent):
            key = self._node(event, where, depth + 1)
            if not isinstance(key, str):
                raise ConfigError(self._file, where, "text as key", f"{shown(key)}{_line(event)}")
            if key in tree:
                raise ConfigError(self._file, where, "each key once", f"{shown(key)} again{_line(event)}")
            step = key if key.isidentifier() else shown(key)
            tree[key] = self._node(next(self._events), join(where, step), depth + 1)
        return tree

    def _list(self, where: str, depth: int) -> list[Tree]:
        tree: list[Tree] = []
        while not isinstance(event := next(self._events), SequenceEndEvent):
            tree.append(self._node(event, join(where, len(tree)), depth + 1))
        return tree

    def _scalar(self, event: ScalarEvent, where: str) -> Tree:
        text: str = event.value
        if any("\ud800" <= character <= "\udfff" for character in text):
            raise ConfigError(self._file, where, "text", f"half a character, {shown(text)}")
        if event.style is not None:
            return text
        if NOT_FINITE.fullmatch(text):
            raise ConfigError(self._file, where, "a finite number", text)
        if INTEGER.fullmatch(text) and len(text.lstrip("+-")) > MAX_DIGITS:
            raise ConfigError(self._file, where, f"a number of at most {MAX_DIGITS} digits", shown(text))
        value = _plain(text)
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigError(self._file, where, "a finite number", shown(text))
        return value


def _plain(text: str) -> bool | int | float | str | None:
    """Return what an unquoted scalar means."""
    if text in NULLS:
        return None
    if text in BOOLEANS:
        return BOOLEANS[text]
    if INTEGER.fullmatch(text):
        return int(text)
    return float(text) if DECIMAL.fullmatch(text) else text


def _line(event: Event) -> str:
    return "" if event.start_mark is None else f" in line {event.start_mark.line + 1}"


def _syntax_error(error: yaml.YAMLError, file: str) -> ConfigError:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "text that is not YAML"
    place = "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}"
    return ConfigError(file, place, "YAML", str(problem))


class _Dumper(yaml.SafeDumper):
    """Quotes text that parse_yaml would not read back as text."""

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002
        """Write a value that comes twice twice."""
        return True


def _quote(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    ambiguous = not isinstance(_plain(text), str) or NOT_FINITE.fullmatch(text) is not None
    style = "'" if ambiguous else None if text.isprintable() else '"'
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _quote)
