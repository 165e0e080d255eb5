"""Expressions by precedence climbing. Lines end statements only between them, so that any expression may span lines."""

import math
from typing import NoReturn

from sim_twin.controller.script.arithmetic import int32
from sim_twin.controller.script.errors import ScriptSyntaxError
from sim_twin.controller.script.lexer import Token, line_at
from sim_twin.controller.script.spelling import held
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
    Place,
    PoseLiteral,
    Run,
    StructLiteral,
    Unary,
)

__all__ = ["ExpressionParser"]

_PRECEDENCE = {"or": 1, "xor": 2, "and": 3}
_PRECEDENCE |= dict.fromkeys(("==", "!=", "<", "<=", ">", ">="), 5)
_PRECEDENCE |= dict.fromkeys("+-", 6) | dict.fromkeys("*/%", 7)
_NOT = 4
_MAX_DEPTH = 40  # of blocks, brackets and prefixes together: Python's own stack must outlast the deepest program
_MAX_HEIGHT = 100  # of an expression's tree, to which a + b + c + ... adds one an operator


class ExpressionParser:
    """Holds the place in the tokens.

    Attributes:
        token: The next token.
        kind: Its kind.
        depth: How many blocks, brackets and prefixes are open.
    """

    def __init__(self, text: str, tokens: list[Token]) -> None:
        self._text = text
        self._tokens = tokens
        self._at = 0
        self.token = tokens[0]
        self.kind = self.token.kind
        self.depth = 0
        self._height = 0  # of the expression parsed last

    def advance(self) -> Token:
        """Take the next token."""
        taken = self.token
        self._at += 1
        self.token = self._tokens[min(self._at, len(self._tokens) - 1)]
        self.kind = self.token.kind
        return taken

    def expect(self, kind: str) -> Token:
        """Take a token that must be of this kind."""
        if self.kind != kind:
            self.fail(f"'{kind}'")
        return self.advance()

    def name(self, what: str) -> str:
        """Take a name."""
        if self.kind != "name":
            self.fail(what)
        return self.advance().text

    def descend(self) -> None:
        """Open a block, bracket or prefix."""
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            self.fail(f"at most {_MAX_DEPTH} blocks and brackets inside one another", got="one more")

    def _grow(self, height: int) -> None:
        """Count a node above two parts: the one parsed last and one of this height."""
        self._height = 1 + max(height, self._height)
        if self._height > _MAX_HEIGHT:
            self.fail(f"expressions of at most {_MAX_HEIGHT} operators and brackets above one another", got="one more")

    def fail(self, expected: str, *, got: str = "") -> NoReturn:
        """Give up at the next token."""
        token = self.token
        if not got:
            got = token.kind if token.kind == "end of text" else f"'{token.text[:40]}'"
        raise ScriptSyntaxError(
            line=token.line,
            column=self.column(token),
            text=line_at(self._text, token.offset),
            expected=expected,
            got=got,
        )

    def column(self, token: Token) -> int:
        """Return where on its line a token begins, counted from one."""
        return token.offset - self._text.rfind("\n", 0, token.offset)

    def place(self, token: Token) -> Place:
        """Return where a token begins."""
        return Place(token.line, self.column(token))

    def expression(self) -> Expression:
        """Parse an expression."""
        return self._binary(1)

    def _binary(self, lowest: int) -> Expression:
        left = self._prefix()
        while (level := _PRECEDENCE.get(self.kind, 0)) >= lowest:
            if level <= 3:
                left = self._logic(left, level)
                continue
            symbol = self.advance().kind
            height = self._height
            left = Binary(symbol, left, self._binary(level + 1))
            self._grow(height)
        return left

    def _logic(self, first: Expression, level: int) -> Expression:
        word = self.kind
        operands = [first]
        while self.kind == word:
            self.advance()
            height = self._height
            operands.append(self._binary(level + 1))
            self._height = max(height, self._height)
        self._grow(0)
        return Logic(word, tuple(operands))

    def _prefix(self) -> Expression:
        kind = self.kind
        if kind not in ("-", "+", "not"):
            return self.postfix()
        self.advance()
        self.descend()
        operand = self._binary(_NOT + 1) if kind == "not" else self._prefix()
        self.depth -= 1
        self._grow(0)
        if kind == "not":
            return Not(operand)
        if kind == "-" and isinstance(operand, Constant) and type(operand.value) in (int, float):
            return Constant(-operand.value)  # pyright: ignore[reportOperatorIssue] - a number, as tested
        return Unary(kind, operand)

    def postfix(self) -> Expression:
        """Parse an operand with the indexes, members and calls behind it."""
        self._height = 0
        result = self._primary()
        while self.kind in ("[", ".") and not self.token.is_first:
            height = self._height
            result = self._indexed(result) if self.kind == "[" else self._of(result)
            self._grow(height)
        return result

    def _indexed(self, container: Expression) -> Expression:
        indexes = self._bracketed("[", "]")
        is_pose_literal = isinstance(container, Name) and container.name == "p"
        if is_pose_literal and len(indexes) == 6:
            return PoseLiteral(indexes)
        if len(indexes) not in (1, 2):
            what = "the six numbers of a pose or one or two indexes" if is_pose_literal else "one or two indexes"
            self.fail(what, got=f"{len(indexes)}")
        return Index(container, indexes)

    def _of(self, owner: Expression) -> Expression:
        self.advance()
        name = self.name("a member's name after '.'")
        if self.kind == "(" and not self.token.is_first:
            return MethodCall(owner, name, self._bracketed("(", ")"))
        return Member(owner, name)

    def _primary(self) -> Expression:
        token = self.token
        if token.kind == "name":
            self.advance()
            if self.kind == "(" and not self.token.is_first:
                return self._called(token)
            return Name(token.text, *self.place(token))
        if token.kind == "[":
            return ListLiteral(self._bracketed("[", "]"))
        if token.kind == "(":
            return self._parenthesised()
        if token.kind == "run":
            return self._started()
        return self._constant()

    def _constant(self) -> Expression:
        kind, text = self.kind, self.token.text
        if kind == "number":
            self.advance()
            return Constant(_number(text))
        if kind == "string":
            self.advance()
            return Constant(held(text[1:-1]))
        if kind not in ("True", "False"):
            self.fail("a value")
        self.advance()
        return Constant(kind == "True")

    def _parenthesised(self) -> Expression:
        self.advance()
        self.descend()
        inner = self.expression()
        self.depth -= 1
        self.expect(")")
        return inner

    def _started(self) -> Expression:
        self.advance()
        token = self.token
        name = self.name("a thread's name after 'run'")
        self.expect("(")
        self.expect(")")
        return Run(name, *self.place(token))

    def _bracketed(self, opening: str, closing: str) -> tuple[Expression, ...]:
        self.expect(opening)
        self.descend()
        elements: list[Expression] = []
        height = 0
        while self.kind != closing:
            elements.append(self.expression())
            height = max(height, self._height)
            if self.kind != closing:
                self.expect(",")
        self.depth -= 1
        self._grow(height)
        self.advance()
        return tuple(elements)

    def _called(self, name: Token) -> Expression:
        self.expect("(")
        self.descend()
        positional: list[Expression] = []
        keywords: dict[str, Expression] = {}
        height = 0
        while self.kind != ")":
            if self.kind == "name" and self._tokens[self._at + 1].kind == "=":
                self._keyword(keywords)
            elif keywords:
                self.fail("a keyword argument after a keyword argument")
            else:
                positional.append(self.expression())
            height = max(height, self._height)
            if self.kind != ")":
                self.expect(",")
        self.depth -= 1
        self._grow(height)
        self.advance()
        if name.text == "struct" and not positional:
            return StructLiteral(tuple(keywords.items()))
        return Call(name.text, tuple(positional), tuple(keywords.items()), *self.place(name))

    def _keyword(self, keywords: dict[str, Expression]) -> None:
        if self.token.text in keywords:
            self.fail("keyword arguments of different names")
        key = self.advance().text
        self.advance()
        keywords[key] = self.expression()


def _number(text: str) -> int | float:
    if text[:2] in ("0x", "0X"):
        return int32(int(text, 16))
    if text.isdigit():
        # Beyond 32 bits a float is nearest to what is meant; Python refuses integers of thousands of digits.
        return int(text) if len(text) <= 10 and int(text) <= 0x7FFF_FFFF else _float(text)
    return _float(text)


def _float(text: str) -> float:
    number = float(text)
    return number if math.isfinite(number) else math.inf
