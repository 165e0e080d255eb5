"""The tree of a program. Nodes are plain and never change; a statement knows its place."""

from typing import NamedTuple, TypeAlias

import msgspec

__all__ = [
    "Assign",
    "Binary",
    "Call",
    "Constant",
    "Critical",
    "Definition",
    "Evaluate",
    "Expression",
    "Halt",
    "If",
    "Index",
    "Jump",
    "ListLiteral",
    "Logic",
    "Member",
    "MethodCall",
    "Name",
    "Not",
    "Parameter",
    "Place",
    "PoseLiteral",
    "Program",
    "Return",
    "Run",
    "Statement",
    "StructLiteral",
    "ThreadAction",
    "Unary",
    "While",
]


class Place(NamedTuple):
    """A place in the text, counted from one; 0 where it is none."""

    line: int
    column: int


class Constant(msgspec.Struct, frozen=True):
    """A number, a string, True or False."""

    value: bool | int | float | str


class Name(msgspec.Struct, frozen=True):
    """A variable, and where it stands."""

    name: str
    line: int
    column: int


class ListLiteral(msgspec.Struct, frozen=True):
    """[a, b, ...]."""

    elements: "tuple[Expression, ...]"


class PoseLiteral(msgspec.Struct, frozen=True):
    """p[x, y, z, rx, ry, rz]."""

    elements: "tuple[Expression, ...]"


class StructLiteral(msgspec.Struct, frozen=True):
    """struct(a=..., b=...)."""

    members: "tuple[tuple[str, Expression], ...]"


class Unary(msgspec.Struct, frozen=True):
    """- or + before an operand."""

    symbol: str
    operand: "Expression"


class Not(msgspec.Struct, frozen=True):
    """Not before a condition."""

    operand: "Expression"


class Binary(msgspec.Struct, frozen=True):
    """Arithmetic or a comparison."""

    symbol: str
    left: "Expression"
    right: "Expression"


class Logic(msgspec.Struct, frozen=True):
    """A chain of one of: and, or, xor. The first two stop at the operand that decides."""

    word: str
    operands: "tuple[Expression, ...]"


class Index(msgspec.Struct, frozen=True):
    """container[i] or matrix[i, j]."""

    container: "Expression"
    indexes: "tuple[Expression, ...]"


class Member(msgspec.Struct, frozen=True):
    """owner.name."""

    owner: "Expression"
    name: str


class Call(msgspec.Struct, frozen=True):
    """name(a, b, key=c)."""

    name: str
    positional: "tuple[Expression, ...]"
    keywords: "tuple[tuple[str, Expression], ...]"
    line: int
    column: int


class MethodCall(msgspec.Struct, frozen=True):
    """owner.name(a, b)."""

    owner: "Expression"
    name: str
    arguments: "tuple[Expression, ...]"


class Run(msgspec.Struct, frozen=True):
    """Run thread(), and where its name stands."""

    name: str
    line: int
    column: int


Expression: TypeAlias = (
    Constant
    | Name
    | ListLiteral
    | PoseLiteral
    | StructLiteral
    | Unary
    | Not
    | Binary
    | Logic
    | Index
    | Member
    | Call
    | MethodCall
    | Run
)


class Assign(msgspec.Struct, frozen=True):
    """Target = value; scope is "global", "local" or "" where the program leaves it open."""

    place: Place
    scope: str
    target: Name | Index | Member
    value: Expression


class Evaluate(msgspec.Struct, frozen=True):
    """An expression for what it does."""

    place: Place
    expression: Expression


class If(msgspec.Struct, frozen=True):
    """If and elif branches in order, then the else block."""

    place: Place
    branches: "tuple[tuple[Place, Expression, tuple[Statement, ...]], ...]"
    otherwise: "tuple[Statement, ...]"


class While(msgspec.Struct, frozen=True):
    """A loop."""

    place: Place
    condition: Expression
    body: "tuple[Statement, ...]"


class Jump(msgspec.Struct, frozen=True):
    """Break or continue."""

    place: Place
    word: str


class Return(msgspec.Struct, frozen=True):
    """Return, with or without a value."""

    place: Place
    value: Expression | None


class ThreadAction(msgspec.Struct, frozen=True):
    """Kill or join, and the handle."""

    place: Place
    word: str
    handle: Expression


class Critical(msgspec.Struct, frozen=True):
    """enter_critical or exit_critical."""

    place: Place
    is_enter: bool


class Halt(msgspec.Struct, frozen=True):
    """Ends the program."""

    place: Place


class Parameter(msgspec.Struct, frozen=True):
    """A parameter and, if it has one, its default."""

    name: str
    default: Expression | None


class Definition(msgspec.Struct, frozen=True):
    """A function, a thread, or the program itself."""

    place: Place
    name: str
    is_thread: bool
    parameters: tuple[Parameter, ...]
    body: "tuple[Statement, ...]"


Statement: TypeAlias = Assign | Evaluate | If | While | Jump | Return | ThreadAction | Critical | Halt | Definition


class Program(msgspec.Struct, frozen=True):
    """A parsed program.

    Attributes:
        name: As the text names it, empty where it is bare statements.
        is_secondary: It is a `sec`, which may take no physical time.
        body: Its statements.
    """

    name: str
    is_secondary: bool
    body: tuple[Statement, ...]
