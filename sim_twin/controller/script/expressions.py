"""Compiles expressions to closures."""

from collections.abc import Callable
from functools import partial

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.arithmetic import PLAIN
from sim_twin.controller.script.calls import compile_call, compile_run
from sim_twin.controller.script.code import UNSET, Code, Fast, Frame, Slow, applied
from sim_twin.controller.script.context import Scope
from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.methods import call_method
from sim_twin.controller.script.syntax import (
    Binary,
    Call,
    Constant,
    Expression,
    Index,
    ListLiteral,
    Logic,
    Member,
    MethodCall,
    Name,
    Not,
    PoseLiteral,
    Run,
    StructLiteral,
    Unary,
)
from sim_twin.controller.script.threads import Steps
from sim_twin.controller.script.values import ScriptStruct, Value, described, item, member, truth

__all__ = ["compile_expression", "compile_read"]


def compile_expression(node: Expression, scope: Scope) -> Code[Value]:
    """Compile an expression of a function."""
    return _COMPILERS[type(node)](node, scope)


def compile_read(name: str, scope: Scope) -> Fast[Value]:
    """Compile reading a variable that there is."""
    place = scope.places.get(name)
    if place is None:
        return _read(name, scope.context.globals, scope.context.global_places[name])
    global_place = scope.context.global_places.get(name)
    if name in scope.is_open and global_place is not None:
        return _read_open(name, scope.context.globals, global_place, place)

    def read_own(frame: Frame) -> Value:
        value = frame[place]
        if value is UNSET:
            raise ScriptRuntimeError(f"the variable '{name}' has no value yet")
        return value

    return Fast(read_own)


def _read(name: str, variables: Frame, place: int) -> Fast[Value]:
    def read(_: Frame) -> Value:
        value = variables[place]
        if value is UNSET:
            raise ScriptRuntimeError(f"the variable '{name}' has no value yet")
        return value

    return Fast(read)


def _read_open(name: str, variables: Frame, global_place: int, place: int) -> Fast[Value]:
    def read(frame: Frame) -> Value:
        value = variables[global_place]
        if value is UNSET:
            value = frame[place]
            if value is UNSET:
                raise ScriptRuntimeError(f"the variable '{name}' has no value yet")
        return value

    return Fast(read)


def _constant(node: Constant, _: Scope) -> Code[Value]:
    value = node.value
    return Fast(lambda _: value)


def _name(node: Name, scope: Scope) -> Code[Value]:
    return compile_read(node.name, scope)


def _compiled(nodes: tuple[Expression, ...], scope: Scope) -> list[Code[Value]]:
    return [compile_expression(node, scope) for node in nodes]


def _list(node: ListLiteral, scope: Scope) -> Code[Value]:
    copied = scope.context.copied
    return applied(lambda *elements: [copied(element) for element in elements], _compiled(node.elements, scope))


def _pose(node: PoseLiteral, scope: Scope) -> Code[Value]:
    def made(*elements: Value) -> Value:
        for element in elements:
            if type(element) is not float and type(element) is not int:
                raise ScriptRuntimeError(f"expected numbers in p[ ], got {described(element)}")
        return Pose(*map(float, elements))  # pyright: ignore[reportArgumentType] - numbers, as tested

    return applied(made, _compiled(node.elements, scope))


def _struct(node: StructLiteral, scope: Scope) -> Code[Value]:
    names, copied = [name for name, _ in node.members], scope.context.copied

    def made(*values: Value) -> Value:
        return ScriptStruct({name: copied(value) for name, value in zip(names, values, strict=True)})

    return applied(made, [compile_expression(value, scope) for _, value in node.members])


def _unary(node: Unary, scope: Scope) -> Code[Value]:
    return applied(scope.context.unary[node.symbol], [compile_expression(node.operand, scope)])


def _not(node: Not, scope: Scope) -> Code[Value]:
    return applied(lambda value: not truth(value), [compile_expression(node.operand, scope)])


def _binary(node: Binary, scope: Scope) -> Code[Value]:
    operator = scope.context.binary[node.symbol]
    if isinstance(node.left, Constant) or isinstance(node.right, Constant):
        operator = PLAIN.get(node.symbol, operator)
    return applied(operator, _compiled((node.left, node.right), scope))


def _logic(node: Logic, scope: Scope) -> Code[Value]:
    operands = _compiled(node.operands, scope)
    if node.word == "xor":
        return applied(lambda *values: sum(map(truth, values)) % 2 == 1, operands)
    decides = node.word == "or"
    fast = [operand.run for operand in operands if isinstance(operand, Fast)]
    if len(fast) < len(operands):
        return _slow_logic(operands, decides)

    def run(frame: Frame) -> Value:
        for operand in fast:
            value = operand(frame)
            if (value if value is True or value is False else truth(value)) is decides:
                return decides
        return not decides

    return Fast(run)


def _slow_logic(operands: list[Code[Value]], decides: bool) -> Code[Value]:
    def run(frame: Frame) -> Steps[Value]:
        for operand in operands:
            value = (yield from operand.run(frame)) if isinstance(operand, Slow) else operand.run(frame)
            if truth(value) is decides:
                return decides
        return not decides

    return Slow(run)


def _index(node: Index, scope: Scope) -> Code[Value]:
    return applied(item, _compiled((node.container, *node.indexes), scope))


def _member(node: Member, scope: Scope) -> Code[Value]:
    name = node.name
    return applied(lambda owner: member(owner, name), [compile_expression(node.owner, scope)])


def _method(node: MethodCall, scope: Scope) -> Code[Value]:
    name, spend = node.name, scope.context.meter.spend
    operands = _compiled((node.owner, *node.arguments), scope)
    return applied(lambda owner, *arguments: call_method(spend, owner, name, *arguments), operands)


def _call(node: Call, scope: Scope) -> Code[Value]:
    return compile_call(node, scope, partial(compile_expression, scope=scope))


def _run(node: Run, scope: Scope) -> Code[Value]:
    return compile_run(node, scope)


_COMPILERS: dict[type, Callable[..., Code[Value]]] = {
    Constant: _constant,
    Name: _name,
    ListLiteral: _list,
    PoseLiteral: _pose,
    StructLiteral: _struct,
    Unary: _unary,
    Not: _not,
    Binary: _binary,
    Logic: _logic,
    Index: _index,
    Member: _member,
    MethodCall: _method,
    Call: _call,
    Run: _run,
}
