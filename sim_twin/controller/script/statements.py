"""Compiles statements to closures, which return how they ended: None to go on, or a signal."""

from collections.abc import Callable
from typing import Any

from sim_twin.controller.script.assignments import compile_assignment
from sim_twin.controller.script.code import Code, Fast, Frame, Signal, Slow
from sim_twin.controller.script.context import Routine, Scope
from sim_twin.controller.script.costs import round_cost, statement_cost
from sim_twin.controller.script.expressions import compile_expression
from sim_twin.controller.script.syntax import (
    Assign,
    Critical,
    Definition,
    Evaluate,
    Halt,
    If,
    Jump,
    Place,
    Return,
    Statement,
    ThreadAction,
    While,
)
from sim_twin.controller.script.threads import ProgramHalted, Steps, Wait
from sim_twin.controller.script.values import Value, truth

__all__ = ["compile_body", "compile_routine"]

Ending = Signal | None


def compile_body(scope: Scope) -> Code[Ending]:
    """Compile the body of a function, a thread or the program."""
    return _block(scope.body, scope)


def compile_routine(routine: Routine) -> None:
    """Compile a function or thread: its body and the defaults of its parameters."""
    scope = routine.scope
    for parameter in routine.definition.parameters:
        if parameter.default is not None:
            routine.defaults[parameter.name] = compile_expression(parameter.default, scope)
    routine.body = compile_body(scope)


def _block(body: tuple[Statement, ...], scope: Scope) -> Code[Ending]:
    nodes = [node for node in body if not isinstance(node, Definition)]
    steps = [(node.place, _COMPILERS[type(node)](node, scope)) for node in nodes]
    costs = [statement_cost(node) for node in nodes]
    fast = [(place, step.run) for place, step in steps if isinstance(step, Fast)]
    if len(fast) < len(steps):
        return _slow_block(steps, costs, scope)
    meter, cost = scope.context.meter, sum(costs)

    def run(frame: Frame) -> Ending:
        meter.left -= cost
        if meter.left < 0:
            meter.place = fast[0][0]
            meter.spend(0)
        for place, step in fast:
            meter.place = place
            signal = step(frame)
            if signal is not None:
                return signal
        return None

    return Fast(run)


def _slow_block(steps: list[tuple[Place, Code[Ending]]], costs: list[int], scope: Scope) -> Code[Ending]:
    meter = scope.context.meter
    # Whether a step may take time is asked here once, not at every turn.
    kinds: list[tuple[Place, Callable[[Frame], Any], bool, int]] = [
        (place, step.run, isinstance(step, Slow), cost) for (place, step), cost in zip(steps, costs, strict=True)
    ]

    def run(frame: Frame) -> Steps[Ending]:
        for place, step, is_slow, cost in kinds:
            meter.place = place
            meter.left -= cost
            if meter.left < 0:
                meter.spend(0)
            signal = (yield from step(frame)) if is_slow else step(frame)
            if signal is not None:
                return signal
        return None

    return Slow(run)


def _assign(node: Assign, scope: Scope) -> Code[Ending]:
    return compile_assignment(node, scope)


def _evaluate(node: Evaluate, scope: Scope) -> Code[Ending]:
    code = compile_expression(node.expression, scope)
    if isinstance(code, Fast):
        evaluate = code.run

        def run(frame: Frame) -> Ending:
            evaluate(frame)
            return None

        return Fast(run)
    evaluate_slowly = code.run

    def run_slowly(frame: Frame) -> Steps[Ending]:
        yield from evaluate_slowly(frame)
        return None

    return Slow(run_slowly)


def _if(node: If, scope: Scope) -> Code[Ending]:
    branches = [(at, compile_expression(test, scope), _block(body, scope)) for at, test, body in node.branches]
    otherwise = _block(node.otherwise, scope)
    fast = [
        (place, test.run, block.run)
        for place, test, block in branches
        if isinstance(test, Fast) and isinstance(block, Fast)
    ]
    meter = scope.context.meter
    if len(fast) == len(branches) and isinstance(otherwise, Fast):
        last = otherwise.run

        def run(frame: Frame) -> Ending:
            for place, test, block in fast:
                meter.place = place
                value = test(frame)
                if value if value is True or value is False else truth(value):
                    return block(frame)
            return last(frame)

        return Fast(run)

    def run_slowly(frame: Frame) -> Steps[Ending]:
        chosen: Code[Ending] = otherwise
        for place, test, block in branches:
            meter.place = place
            value = (yield from test.run(frame)) if isinstance(test, Slow) else test.run(frame)
            if value if value is True or value is False else truth(value):
                chosen = block
                break
        return (yield from chosen.run(frame)) if isinstance(chosen, Slow) else chosen.run(frame)

    return Slow(run_slowly)


def _while(node: While, scope: Scope) -> Code[Ending]:
    test, block = compile_expression(node.condition, scope), _block(node.body, scope)
    meter, place, cost = scope.context.meter, node.place, round_cost(node)

    def begin_round() -> None:
        meter.place = place
        meter.left -= cost
        if meter.left < 0:
            meter.spend(0)

    if isinstance(test, Fast) and isinstance(block, Fast):
        return _fast_while(test.run, block.run, begin_round)

    def run(frame: Frame) -> Steps[Ending]:
        while True:
            begin_round()
            if not truth((yield from test.run(frame)) if isinstance(test, Slow) else test.run(frame)):
                return None
            signal = (yield from block.run(frame)) if isinstance(block, Slow) else block.run(frame)
            if signal is Signal.RETURN:
                return signal
            if signal is Signal.BREAK:
                return None

    return Slow(run)


def _fast_while(
    test: Callable[[Frame], Value], block: Callable[[Frame], Ending], begin_round: Callable[[], None]
) -> Code[Ending]:
    def run(frame: Frame) -> Ending:
        while True:
            begin_round()
            if not truth(test(frame)):
                return None
            signal = block(frame)
            if signal is Signal.RETURN:
                return signal
            if signal is Signal.BREAK:
                return None

    return Fast(run)


def _jump(node: Jump, _: Scope) -> Code[Ending]:
    signal = Signal.BREAK if node.word == "break" else Signal.CONTINUE
    return Fast(lambda _: signal)


def _return(node: Return, scope: Scope) -> Code[Ending]:
    if node.value is None:
        return Fast(lambda _: Signal.RETURN)
    code, copied = compile_expression(node.value, scope), scope.context.copied

    def run(frame: Frame) -> Ending:
        if isinstance(code, Fast):
            frame[0] = copied(code.run(frame))
        return Signal.RETURN

    def run_slowly(frame: Frame) -> Steps[Ending]:
        if isinstance(code, Slow):
            frame[0] = copied((yield from code.run(frame)))
        return Signal.RETURN

    return Slow(run_slowly) if isinstance(code, Slow) else Fast(run)


def _thread_action(node: ThreadAction, scope: Scope) -> Code[Ending]:
    handle = compile_expression(node.handle, scope)
    scheduler = scope.context.scheduler

    def run(frame: Frame) -> Steps[Ending]:
        value = (yield from handle.run(frame)) if isinstance(handle, Slow) else handle.run(frame)
        if node.word == "kill":
            scheduler.kill(value)
            return None
        while scheduler.is_alive(value):
            yield Wait.JOIN
        return None

    def kill(frame: Frame) -> Ending:
        if isinstance(handle, Fast):
            scheduler.kill(handle.run(frame))
        return None

    return Fast(kill) if node.word == "kill" and isinstance(handle, Fast) else Slow(run)


def _critical(node: Critical, scope: Scope) -> Code[Ending]:
    scheduler = scope.context.scheduler

    def enter(_: Frame) -> Steps[Ending]:
        if scheduler.is_contended:
            yield Wait.GIVE_WAY
        scheduler.enter()
        return None

    def leave(_: Frame) -> Ending:
        scheduler.leave()
        return None

    return Slow(enter) if node.is_enter else Fast(leave)


def _halt(_: Halt, __: Scope) -> Code[Ending]:
    def run(_: Frame) -> Ending:
        raise ProgramHalted

    return Fast(run)


_COMPILERS: dict[type, Callable[..., Code[Ending]]] = {
    Assign: _assign,
    Evaluate: _evaluate,
    If: _if,
    While: _while,
    Jump: _jump,
    Return: _return,
    ThreadAction: _thread_action,
    Critical: _critical,
    Halt: _halt,
}
