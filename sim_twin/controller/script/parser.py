"""From tokens to the tree: statements by recursive descent, on top of the parser of expressions."""

from collections.abc import Callable

from sim_twin.controller.script.expression_parser import ExpressionParser
from sim_twin.controller.script.lexer import tokens_of
from sim_twin.controller.script.syntax import (
    Assign,
    Call,
    Critical,
    Definition,
    Evaluate,
    Expression,
    Halt,
    If,
    Index,
    Jump,
    Member,
    MethodCall,
    Name,
    Parameter,
    Place,
    Program,
    Return,
    Run,
    Statement,
    ThreadAction,
    While,
)

__all__ = ["parse_program"]

_BLOCK_ENDS = frozenset({"end", "elif", "else", "end of text"})


def parse_program(text: str) -> Program:
    """Parse what a client sends: one `def` or `sec` program, or bare statements.

    Raises:
        ScriptSyntaxError: It does not parse; the error knows line and column.
    """
    return _Parser(text, tokens_of(text)).program()


class _Parser(ExpressionParser):
    """Statements, one method each; `_loops` and `_functions` say what break and return would leave."""

    _loops = 0
    _functions = 0

    def program(self) -> Program:
        if self.kind in ("def", "sec"):
            is_secondary = self.kind == "sec"
            program = self._definition()
            result = Program(program.name, is_secondary, program.body)
            if program.parameters:
                self.fail("a program without parameters", got=f"{len(program.parameters)} of them")
        else:
            result = Program("", False, self._block("the end of the text"))
        if self.kind != "end of text":
            self.fail("the end of the text after the program's end")
        return result

    def _block(self, closed_by: str = "'end'") -> tuple[Statement, ...]:
        statements: list[Statement] = []
        self.descend()
        while self.kind not in _BLOCK_ENDS:
            statements.append(self._statement())
            if self.kind == ";":
                self.advance()
            elif not (self.token.is_first or self.kind in _BLOCK_ENDS or self.kind in _STATEMENTS):
                # A word that begins a statement may follow on the line: ur_rtde sends "0    global offset = ...".
                self.fail("the end of the line after a statement")
        self.depth -= 1
        if self.kind == "end of text" and closed_by == "'end'":
            self.fail(closed_by)
        return tuple(statements)

    def _statement(self) -> Statement:
        parse = _STATEMENTS.get(self.kind)
        if parse is not None:
            return parse(self)
        return self._assignment_or_call()

    def _assignment_or_call(self) -> Statement:
        place = self.place(self.token)
        if self.kind != "name":
            self.fail("a statement")
        target = self.postfix()
        if self.kind == "=":
            return self._assigned(place, "", target)
        if not isinstance(target, Call | MethodCall):
            self.fail("'=' or a call's '('")
        return Evaluate(place, target)

    def _scoped(self) -> Statement:
        token = self.advance()
        target = Name(self.name("a variable's name"), *self.place(self._tokens[self._at - 1]))
        if self.kind != "=":
            self.fail("'='")
        return self._assigned(self.place(token), token.kind, target)

    def _assigned(self, place: Place, scope: str, target: Expression) -> Statement:
        root = target
        while isinstance(root, Index | Member):
            root = root.container if isinstance(root, Index) else root.owner
        if not isinstance(root, Name) or not isinstance(target, Name | Index | Member):
            self.fail("a variable, an element or a member before '='", got="something else")
        self.expect("=")
        return Assign(place, scope, target, self.expression())

    def _definition(self) -> Definition:
        token = self.advance()
        name = self.name("a name for what is defined")
        self.expect("(")
        parameters: list[Parameter] = []
        while self.kind != ")":
            parameters.append(self._parameter(parameters))
            if self.kind != ")":
                self.expect(",")
        self.expect(")")
        self.expect(":")
        if token.kind == "thread" and parameters:
            self.fail("a thread without parameters", got=f"{len(parameters)} of them")
        loops, self._loops = self._loops, 0
        self._functions += 1
        body = self._block()
        self._functions -= 1
        self._loops = loops
        self.expect("end")
        return Definition(self.place(token), name, token.kind == "thread", tuple(parameters), body)

    def _parameter(self, before: list[Parameter]) -> Parameter:
        name = self.name("a parameter's name or ')'")
        if any(name == parameter.name for parameter in before):
            self.fail("parameters of different names", got=f"'{name}' twice")
        if self.kind == "=":
            self.advance()
            return Parameter(name, self.expression())
        if before and before[-1].default is not None:
            self.fail(f"'=' and a default for '{name}', since the parameter before it has one")
        return Parameter(name, None)

    def _nested_definition(self) -> Statement:
        if self.kind == "sec":
            self.fail("'def' or 'thread' inside a program")
        return self._definition()

    def _if(self) -> Statement:
        place = self.place(self.token)
        branches: list[tuple[Place, Expression, tuple[Statement, ...]]] = []
        otherwise: tuple[Statement, ...] = ()
        while not branches or self.kind == "elif":
            at = self.place(self.advance())
            condition = self.expression()
            self.expect(":")
            branches.append((at, condition, self._block()))
        if self.kind == "else":
            self.advance()
            self.expect(":")
            otherwise = self._block()
        self.expect("end")
        return If(place, tuple(branches), otherwise)

    def _while(self) -> Statement:
        place = self.place(self.advance())
        condition = self.expression()
        self.expect(":")
        self._loops += 1
        body = self._block()
        self._loops -= 1
        self.expect("end")
        return While(place, condition, body)

    def _jump(self) -> Statement:
        if not self._loops:
            self.fail(f"a loop around '{self.kind}'", got="none")
        token = self.advance()
        return Jump(self.place(token), token.kind)

    def _return(self) -> Statement:
        if not self._functions:
            self.fail("a function around 'return'", got="none")
        place = self.place(self.advance())
        if self.token.is_first or self.kind in _BLOCK_ENDS or self.kind == ";":
            return Return(place, None)
        return Return(place, self.expression())

    def _thread_action(self) -> Statement:
        token = self.advance()
        return ThreadAction(self.place(token), token.kind, self.expression())

    def _critical(self) -> Statement:
        token = self.advance()
        return Critical(self.place(token), token.kind == "enter_critical")

    def _halt(self) -> Statement:
        place = self.place(self.advance())
        if self.kind == "(" and not self.token.is_first:
            self.advance()
            self.expect(")")
        return Halt(place)

    def _run(self) -> Statement:
        place = self.place(self.token)
        expression = self.expression()
        if not isinstance(expression, Run):
            self.fail("the end of the line after 'run'", got="an operator")
        return Evaluate(place, expression)


_STATEMENTS: dict[str, Callable[[_Parser], Statement]] = {
    "global": _Parser._scoped,
    "local": _Parser._scoped,
    "def": _Parser._nested_definition,
    "thread": _Parser._nested_definition,
    "sec": _Parser._nested_definition,
    "if": _Parser._if,
    "while": _Parser._while,
    "break": _Parser._jump,
    "continue": _Parser._jump,
    "return": _Parser._return,
    "kill": _Parser._thread_action,
    "join": _Parser._thread_action,
    "enter_critical": _Parser._critical,
    "exit_critical": _Parser._critical,
    "halt": _Parser._halt,
    "run": _Parser._run,
}
