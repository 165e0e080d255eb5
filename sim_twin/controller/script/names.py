"""Finds names that nothing has, in all of a program and before any of it runs, as a robot's compiler does.

A call needs a function of the program that can be seen from there, or a builtin; so does what is called in a branch
that is never taken. A variable needs an assignment to a global of that name anywhere, or one in the same function:
whether it has a value yet is asked when the line runs.
"""

from collections.abc import Collection, Iterator

import msgspec

from sim_twin.controller.script.errors import ScriptNameError
from sim_twin.controller.script.scopes import Functions, assigned_names, definitions_in, global_names, statements_in
from sim_twin.controller.script.syntax import Call, Definition, If, Name, Place, Program, Run, Statement, While

__all__ = ["check_names"]

_Use = Name | Call | Run


class _Known(msgspec.Struct, frozen=True):
    """What a function can name: functions and threads around it, builtins, variables."""

    functions: Functions | None
    builtins: Collection[str]
    globals: Collection[str]

    def inside(self, definition: Definition) -> tuple["_Known", set[str]]:
        """Return what its body can call, and its own variables."""
        body = definition.body
        variables = {parameter.name for parameter in definition.parameters} | assigned_names(body)
        return _Known(Functions(definitions_in(body), self.functions), self.builtins, self.globals), variables

    def has_function(self, name: str) -> bool:
        level = self.functions
        while level is not None:
            if name in level.own:
                return True
            level = level.around
        return False


def check_names(program: Program, *, builtins: Collection[str], variables: Collection[str] = ()) -> None:
    """Look every name of a program up.

    Args:
        program: All of it.
        builtins: Names of what the host offers.
        variables: Global variables that exist before it begins.

    Raises:
        ScriptNameError: nothing has this name; the first such in the text.
    """
    known = _Known(None, builtins, global_names(program) | set(variables))
    main = Definition(Place(1, 1), program.name, False, (), program.body)
    first = min(_unknown(main, known), key=lambda use: (use.line, use.column), default=None)
    if first is not None:
        raise ScriptNameError(first.name, line=first.line, column=first.column)


def _unknown(definition: Definition, around: _Known) -> Iterator[_Use]:
    known, variables = around.inside(definition)
    for parameter in definition.parameters:
        yield from (use for use in _uses(parameter.default) if not _is_known(use, known, variables))
    for statement in statements_in(definition.body):
        if isinstance(statement, Definition):
            yield from _unknown(statement, known)
        else:
            yield from (use for use in _own_uses(statement) if not _is_known(use, known, variables))


def _is_known(use: _Use, known: _Known, variables: set[str]) -> bool:
    if isinstance(use, Name):
        return use.name in variables or use.name in known.globals
    return known.has_function(use.name) or (isinstance(use, Call) and use.name in known.builtins)


def _own_uses(statement: Statement) -> Iterator[_Use]:
    """Yield the names in a statement's own expressions; blocks are statements of their own."""
    if isinstance(statement, If):
        for _, condition, _ in statement.branches:
            yield from _uses(condition)
    elif isinstance(statement, While):
        yield from _uses(statement.condition)
    else:
        yield from _uses(statement)


def _uses(node: object) -> Iterator[_Use]:
    if isinstance(node, _Use):
        yield node
    if isinstance(node, tuple):
        for part in node:
            yield from _uses(part)
    elif isinstance(node, msgspec.Struct):
        for part in node.__struct_fields__:
            yield from _uses(getattr(node, part))
