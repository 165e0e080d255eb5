"""Compiles calls: of the program's functions, of the host's builtins, and `run`."""

import inspect
from collections.abc import Callable, Generator, Mapping, Sequence
from types import GeneratorType

from sim_twin.controller.script.code import Builtin, Code, Fast, Frame, Slow, applied
from sim_twin.controller.script.context import Context, Routine, Scope, takes_time
from sim_twin.controller.script.costs import NUMBERS, WRITING, length_cost, text_cost
from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.syntax import Call, Definition, Expression, Place, Run
from sim_twin.controller.script.threads import Steps, Wait
from sim_twin.controller.script.values import Value, described

__all__ = ["compile_call", "compile_run"]

_MAX_DEPTH = 50  # of calls: Python's own stack must outlast them
_BAD_ARGUMENTS = (TypeError, ValueError, LookupError, ArithmeticError)


def compile_call(node: Call, scope: Scope, compiled: Callable[[Expression], Code[Value]]) -> Code[Value]:
    """Compile a call of a function that there is; what is wrong with its arguments shows when it runs, as on a robot.

    Args:
        node: The call.
        scope: Where it stands.
        compiled: Compiles an argument.
    """
    positional = [compiled(argument) for argument in node.positional]
    keywords = {name: compiled(argument) for name, argument in node.keywords}
    found = scope.find(node.name)
    if found is not None:
        definition, around = found
        if definition.is_thread:
            return _failing(f"'{node.name}' is a thread, start it with run {node.name}()")
        routine = scope.context.routine(definition, around)
        return _call_of_routine(scope.context, routine, _bound(definition, positional, keywords))
    builtin = scope.context.builtins[node.name]
    mistake = _mistake(node.name, _parameters_of(scope.context.signature(node.name)), len(positional), keywords)
    if mistake:
        return _failing(mistake)
    return _call_of_builtin(node.name, builtin, positional, keywords, scope.context)


def compile_run(node: Run, scope: Scope) -> Code[Value]:
    """Compile the start of a thread; its value is the handle."""
    found = scope.find(node.name)
    if found is None or not found[0].is_thread:
        return _failing(f"expected the name of a thread after run, got '{node.name}'")
    context = scope.context
    routine = context.routine(*found)

    def run(_: Frame) -> Value:
        return context.scheduler.start(routine.definition.name, _work(routine))

    return Fast(run)


def _work(routine: Routine) -> Steps[object]:
    if isinstance(routine.body, Slow):
        yield from routine.body.run(routine.frame())
    elif routine.body is not None:
        routine.body.run(routine.frame())


def _failing(message: str) -> Fast[Value]:
    def run(_: Frame) -> Value:
        raise ScriptRuntimeError(message)

    return Fast(run)


def _bound(
    definition: Definition, positional: list[Code[Value]], keywords: Mapping[str, Code[Value]]
) -> dict[str, Code[Value]] | str:
    """Match arguments with parameters; return what is wrong, where something is."""
    needed = {parameter.name: parameter.default is None for parameter in definition.parameters}
    mistake = _mistake(definition.name, needed, len(positional), keywords)
    return mistake or {**dict(zip(needed, positional, strict=False)), **keywords}


def _mistake(
    function: str, is_needed: Mapping[str, bool] | None, n_positional: int, keywords: Mapping[str, Code[Value]]
) -> str:
    """Say what is wrong with the number and names of arguments, where something is; None takes any."""
    if is_needed is None:
        return ""
    names = list(is_needed)
    if n_positional > len(names):
        return f"{function}() takes {len(names)} arguments, got {n_positional}"
    given = set(names[:n_positional])
    for name in keywords:
        if name not in is_needed:
            return f"{function}() has no parameter '{name}'"
        if name in given:
            return f"{function}() got the argument '{name}' twice"
    missing = [name for name in names if is_needed[name] and name not in given and name not in keywords]
    return f"{function}() misses the argument '{missing[0]}'" if missing else ""


def _parameters_of(signature: inspect.Signature | None) -> dict[str, bool] | None:
    """Return a builtin's parameters and whether each is needed; None where it takes any."""
    if signature is None or any(p.kind is p.VAR_POSITIONAL for p in signature.parameters.values()):
        return None
    return {name: p.default is p.empty for name, p in signature.parameters.items()}


def _call_of_routine(context: Context, routine: Routine, bound: dict[str, Code[Value]] | str) -> Code[Value]:
    if isinstance(bound, str):
        return _failing(bound)
    arguments = [(routine.scope.places[name], code) for name, code in bound.items()]
    defaults = [
        (routine.scope.places[parameter.name], parameter.name)
        for parameter in routine.definition.parameters
        if parameter.name not in bound
    ]
    if routine.definition.name in context.slow or any(isinstance(code, Slow) for _, code in arguments):
        return _slow_call(context, routine, arguments, defaults)
    fast = [(place, code.run) for place, code in arguments if isinstance(code, Fast)]
    meter, copied = context.meter, context.copied

    def call(frame: Frame) -> Value:
        inner = routine.frame()
        for place, argument in fast:
            inner[place] = copied(argument(frame))
        for place, name in defaults:
            default = routine.defaults[name]
            inner[place] = default.run(inner) if isinstance(default, Fast) else None
        place = _open(context, routine)
        body = routine.body
        if isinstance(body, Fast):
            body.run(inner)
        meter.depth -= 1
        meter.place = place
        return inner[0]  # pyright: ignore[reportReturnType] - the first place is never unset

    return Fast(call)


def _slow_call(
    context: Context,
    routine: Routine,
    arguments: list[tuple[int, Code[Value]]],
    defaults: list[tuple[int, str]],
) -> Code[Value]:
    meter, copied = context.meter, context.copied

    def call(frame: Frame) -> Steps[Value]:
        inner = routine.frame()
        for place, code in arguments:
            inner[place] = copied((yield from code.run(frame)) if isinstance(code, Slow) else code.run(frame))
        for place, name in defaults:
            code = routine.defaults[name]
            inner[place] = (yield from code.run(inner)) if isinstance(code, Slow) else code.run(inner)
        place = _open(context, routine)
        body = routine.body
        if isinstance(body, Slow):
            yield from body.run(inner)
        elif body is not None:
            body.run(inner)
        meter.depth -= 1
        meter.place = place
        return inner[0]  # pyright: ignore[reportReturnType] - as above

    return Slow(call)


def _open(context: Context, routine: Routine) -> Place:
    """Begin a call; return the statement that it stands in, which is the one again once it is over."""
    meter = context.meter
    meter.left -= routine.cost
    meter.depth += 1
    if meter.depth > _MAX_DEPTH:
        name = routine.definition.name
        raise ScriptRuntimeError(f"{name}() calls itself too deep, at most {_MAX_DEPTH} calls may be open")
    return meter.place


def _reason(error: Exception, values: Sequence[Value]) -> str:
    """Return what a builtin says is wrong; where only Python said something, say what came."""
    said = str(error)
    is_ours = type(error).__module__.startswith("sim_twin.") or said.startswith("expected ") or ": expected " in said
    return said if is_ours else f"expected other arguments, got {', '.join(map(described, values)) or 'none'}"


def _costs_of(builtin: str, own: int) -> Callable[[Sequence[Value]], int]:
    """Return what tells a call's cost by its arguments."""
    if builtin in WRITING:
        return lambda values: own + sum(length_cost(value) + text_cost(value) for value in values)
    return lambda values: own + sum(map(length_cost, values))


def _are_numbers(values: Sequence[Value]) -> bool:
    """Return whether values are numbers alone: those need no copies, and cost nothing to go through."""
    for value in values:  # noqa: SIM110 - half of what a generator takes
        if type(value) not in NUMBERS:
            return False
    return True


def _call_of_builtin(
    called: str,
    builtin: Builtin,
    positional: list[Code[Value]],
    keywords: Mapping[str, Code[Value]],
    context: Context,
) -> Code[Value]:
    n_positional, names = len(positional), list(keywords)
    own = context.cost(called)
    spend, copied, cost_with = context.meter.spend, context.copied, _costs_of(called, own)

    def failed(error: Exception, values: Sequence[Value]) -> ScriptRuntimeError:
        return ScriptRuntimeError(f"{called}(): {_reason(error, values)}")

    def named(*values: Value) -> "Value | Generator[Wait | None, None, Value]":
        given = zip(names, values[n_positional:], strict=True)
        return builtin(*values[:n_positional], **dict(given))

    function = named if names else builtin

    def result_of(*values: Value) -> "Value | Generator[Wait | None, None, Value]":
        spend(cost_with(values))
        try:
            return function(*map(copied, values))
        except _BAD_ARGUMENTS as error:
            raise failed(error, values) from error

    operands = [*positional, *keywords.values()]
    if takes_time(builtin):
        return _slow_builtin(operands, result_of, failed)

    def value_of(*values: Value) -> Value:
        is_plain = _are_numbers(values)
        spend(own if is_plain else cost_with(values))
        try:
            result = function(*values) if is_plain else function(*map(copied, values))
        except _BAD_ARGUMENTS as error:
            raise failed(error, values) from error
        if type(result) is GeneratorType:
            raise TypeError(f"builtin {called} returned a generator, so declare it as a generator function")
        if type(result) is list or type(result) is str:
            spend(length_cost(result))
        return result  # pyright: ignore[reportReturnType] - no generator, as tested

    return applied(value_of, operands)


def _slow_builtin(
    operands: list[Code[Value]],
    result_of: Callable[..., "Value | Generator[Wait | None, None, Value]"],
    failed: Callable[[Exception, Sequence[Value]], ScriptRuntimeError],
) -> Code[Value]:
    def run(frame: Frame) -> Steps[Value]:
        values: list[Value] = []
        for operand in operands:
            values.append((yield from operand.run(frame)) if isinstance(operand, Slow) else operand.run(frame))  # noqa: PERF401 - none may yield
        steps = result_of(*values)
        if not isinstance(steps, Generator):
            return steps
        try:
            return (yield from steps)
        except _BAD_ARGUMENTS as error:
            raise failed(error, values) from error

    return Slow(run)
