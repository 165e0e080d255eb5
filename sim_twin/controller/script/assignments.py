"""Compiles assignments to variables, to elements of lists and poses, and to members of structs."""

from collections.abc import Callable

from sim_twin.controller.script.code import UNSET, Code, Fast, Frame, Signal, Slow
from sim_twin.controller.script.context import Scope
from sim_twin.controller.script.expressions import compile_expression, compile_read
from sim_twin.controller.script.syntax import Assign, Expression, Index, Member, Name
from sim_twin.controller.script.threads import Steps
from sim_twin.controller.script.values import ScriptStruct, Value, checked_work, item, member, stored, stored_member

__all__ = ["compile_assignment"]

Write = Callable[[Frame, Value], None]
_N_COUNTED = 3  # elements a step of the budget
_Step = Code[Value] | str  # an index, or a member's name


def compile_assignment(node: Assign, scope: Scope) -> Code[Signal | None]:
    """Compile target = value."""
    value = compile_expression(node.value, scope)
    if isinstance(node.target, Name):
        return _whole(_compile_write(node.target.name, node.scope, scope), value, scope.context.copied)
    name, path = _path(node.target, scope)
    return _part(compile_read(name, scope), _compile_write(name, "", scope), path, value, scope)


def _compile_write(name: str, word: str, scope: Scope) -> Write:
    variables, global_place = scope.context.globals, scope.context.global_places.get(name)
    place = scope.places.get(name)

    def write_global(_: Frame, value: Value) -> None:
        if global_place is not None:
            variables[global_place] = value

    def write_own(frame: Frame, value: Value) -> None:
        if place is not None:
            frame[place] = value

    def write_open(frame: Frame, value: Value) -> None:
        if global_place is None or variables[global_place] is UNSET:
            write_own(frame, value)
        else:
            variables[global_place] = value

    if word == "global" or place is None:
        return write_global
    return write_open if name in scope.is_open else write_own


def _whole(write: Write, value: Code[Value], copied: Callable[[Value], Value]) -> Code[Signal | None]:
    if isinstance(value, Fast):
        evaluate = value.run

        def run(frame: Frame) -> Signal | None:
            write(frame, copied(evaluate(frame)))

        return Fast(run)

    def run_slowly(frame: Frame) -> Steps[Signal | None]:
        write(frame, copied((yield from value.run(frame))))

    return Slow(run_slowly)


def _path(target: Index | Member, scope: Scope) -> tuple[str, list[_Step]]:
    """Return the variable at the root and the steps from it to the part."""
    steps: list[_Step] = []
    node: Expression = target
    while not isinstance(node, Name):
        if isinstance(node, Index):
            steps.extend(compile_expression(index, scope) for index in reversed(node.indexes))
            node = node.container
        elif isinstance(node, Member):
            steps.append(node.name)
            node = node.owner
        else:
            raise TypeError("the parser lets only variables, elements and members stand before '='")
    return node.name, steps[::-1]


def _part(read: Fast[Value], write: Write, path: list[_Step], value: Code[Value], scope: Scope) -> Code[Signal | None]:
    copied, spend = scope.context.copied, scope.context.meter.spend

    def replace(frame: Frame, keys: list[Value], new: Value) -> None:
        whole = _replaced(read.run(frame), path, keys, new)
        if type(new) in (list, ScriptStruct, str):
            spend(checked_work(whole) // _N_COUNTED)
        write(frame, whole)

    if isinstance(value, Fast) and not any(isinstance(step, Slow) for step in path):
        fast = [step.run if isinstance(step, Fast) else step for step in path]

        def run(frame: Frame) -> Signal | None:
            new = copied(value.run(frame))
            keys = [step if isinstance(step, str) else step(frame) for step in fast]  # pyright: ignore[reportCallIssue]
            replace(frame, keys, new)
            return None

        return Fast(run)

    def run_slowly(frame: Frame) -> Steps[Signal | None]:
        new = copied((yield from value.run(frame)) if isinstance(value, Slow) else value.run(frame))
        keys: list[Value] = []
        for step in path:
            if isinstance(step, str):
                keys.append(step)
            else:
                keys.append((yield from step.run(frame)) if isinstance(step, Slow) else step.run(frame))
        replace(frame, keys, new)
        return None

    return Slow(run_slowly)


def _replaced(owner: Value, path: list[_Step], keys: list[Value], new: Value) -> Value:
    """Return the owner with one part replaced, along the keys that the path evaluated to."""
    step, key = path[0], keys[0]
    if isinstance(step, str):
        part = _replaced(member(owner, step), path[1:], keys[1:], new) if len(path) > 1 else new
        return stored_member(owner, step, part)
    part = _replaced(item(owner, key), path[1:], keys[1:], new) if len(path) > 1 else new
    return stored(owner, key, part)
