"""What a program's names stand for, found before it runs: UR's scoping rules, and which functions can take time.

A name assigned at the program's first level, or declared `global` anywhere, is global. In a function a parameter or
a `local` is its own; a name left open is the global one if that exists when the line runs, and the function's own
otherwise. Functions do not see the variables of the functions around them, only their functions.
"""

from collections.abc import Iterator, Mapping

import msgspec

from sim_twin.controller.script.syntax import (
    Assign,
    Call,
    Critical,
    Definition,
    If,
    Name,
    Program,
    Statement,
    ThreadAction,
    While,
)

__all__ = ["Functions", "assigned_names", "definitions_in", "global_names", "slow_functions", "statements_in"]


class Functions:
    """The functions and threads that can be called from one place: its own, then those around it."""

    def __init__(self, own: Mapping[str, Definition], around: "Functions | None" = None) -> None:
        self.own = own
        self.around = around


def statements_in(body: tuple[Statement, ...]) -> Iterator[Statement]:
    """Yield every statement of a body and of its blocks, but not of the functions defined there."""
    for statement in body:
        yield statement
        if isinstance(statement, If):
            for _, _, block in statement.branches:
                yield from statements_in(block)
            yield from statements_in(statement.otherwise)
        elif isinstance(statement, While):
            yield from statements_in(statement.body)


def definitions_in(body: tuple[Statement, ...]) -> dict[str, Definition]:
    """Return the functions and threads defined in a body by name; the last of a name counts."""
    return {node.name: node for node in statements_in(body) if isinstance(node, Definition)}


def assigned_names(body: tuple[Statement, ...], scope: str | None = None) -> set[str]:
    """Return the variables that a body assigns whole; with a scope, those that it assigns with that word."""
    return {
        node.target.name
        for node in statements_in(body)
        if isinstance(node, Assign) and isinstance(node.target, Name) and scope in (None, node.scope)
    }


def global_names(program: Program) -> set[str]:
    """Return every name that can be a global variable."""
    names = assigned_names(program.body)
    for definition in _all_definitions(program.body):
        names |= assigned_names(definition.body, "global")
    return names


def slow_functions(program: Program, slow_builtins: set[str]) -> set[str]:
    """Return the names of the functions and threads that can take time or wait, whatever they call included."""
    calls: dict[str, set[str]] = {}
    slow: set[str] = set()
    for definition in _all_definitions(program.body):
        called = calls.setdefault(definition.name, set())
        for statement in statements_in(definition.body):
            if isinstance(statement, Critical) or (isinstance(statement, ThreadAction) and statement.word == "join"):
                slow.add(definition.name)
            _collect_calls(statement, called)
        for parameter in definition.parameters:
            _collect_calls(parameter.default, called)
    known = slow_builtins - calls.keys() | slow
    while grown := {name for name, called in calls.items() if name not in known and called & known}:
        known |= grown
    return known & calls.keys()


def _all_definitions(body: tuple[Statement, ...]) -> Iterator[Definition]:
    for statement in statements_in(body):
        if isinstance(statement, Definition):
            yield statement
            yield from _all_definitions(statement.body)


def _collect_calls(node: object, into: set[str]) -> None:
    """Gather the names called in a statement's own expressions; blocks are statements of their own."""
    if isinstance(node, Call):
        into.add(node.name)
    if isinstance(node, If):
        for _, condition, _ in node.branches:
            _collect_calls(condition, into)
    elif isinstance(node, While):
        _collect_calls(node.condition, into)
    elif isinstance(node, tuple):
        for part in node:
            _collect_calls(part, into)
    elif isinstance(node, msgspec.Struct) and not isinstance(node, Definition):
        for part in node.__struct_fields__:
            _collect_calls(getattr(node, part), into)
