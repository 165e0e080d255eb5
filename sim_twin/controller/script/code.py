"""What the tree is compiled to: closures over a frame, fast ones that just run and slow ones that can take time."""

import enum
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Final, Generic, Literal, NamedTuple, TypeAlias, TypeVar

from sim_twin.controller.script.threads import Steps, Wait
from sim_twin.controller.script.values import Value

__all__ = ["UNSET", "Builtin", "Builtins", "Code", "Fast", "Frame", "Signal", "Slow", "Unset", "applied"]

T = TypeVar("T")

Builtin: TypeAlias = Callable[..., "Value | Generator[Wait | None, None, Value]"]
Builtins: TypeAlias = Mapping[str, Builtin]


class Unset(enum.Enum):
    """The place of a variable that has no value yet."""

    UNSET = 0


UNSET: Final[Literal[Unset.UNSET]] = Unset.UNSET
Frame: TypeAlias = "list[Value | Unset]"  # a function's variables; the first place is for what it returns


class Signal(enum.Enum):
    """How a statement ended, where not by going on with the next."""

    BREAK = 0
    CONTINUE = 1
    RETURN = 2


class Fast(NamedTuple, Generic[T]):
    """Code that neither takes time nor waits."""

    run: Callable[[Frame], T]


class Slow(NamedTuple, Generic[T]):
    """Code that may; it yields whenever it does."""

    run: Callable[[Frame], Steps[T]]


Code: TypeAlias = Fast[T] | Slow[T]


def applied(function: Callable[..., Value], operands: Sequence[Code[Value]]) -> Code[Value]:
    """Compile the application of a function to operands, evaluated from left to right."""
    fast = [operand.run for operand in operands if isinstance(operand, Fast)]
    if len(fast) < len(operands):
        return _applied_slowly(function, operands)
    if len(fast) == 1:
        only = fast[0]
        return Fast(lambda frame: function(only(frame)))
    if len(fast) == 2:
        left, right = fast
        return Fast(lambda frame: function(left(frame), right(frame)))
    return Fast(lambda frame: function(*[run(frame) for run in fast]))


def _applied_slowly(function: Callable[..., Value], operands: Sequence[Code[Value]]) -> Code[Value]:
    def run(frame: Frame) -> Steps[Value]:
        values: list[Value] = []
        for operand in operands:
            values.append((yield from operand.run(frame)) if isinstance(operand, Slow) else operand.run(frame))  # noqa: PERF401 - none may yield
        return function(*values)

    return Slow(run)
