"""What can go wrong with a script: it does not parse, or it fails while it runs."""

import msgspec

__all__ = ["ScriptError", "ScriptFault", "ScriptNameError", "ScriptRuntimeError", "ScriptSyntaxError"]


class ScriptError(Exception):
    """Anything wrong with a script; whoever wrote the script acts."""


class ScriptSyntaxError(ScriptError):
    """The text is not a program.

    Attributes:
        line: Where, counted from one.
        column: Where on that line, counted from one.
        as_reported: What a robot says of it on the primary port.
    """

    def __init__(self, *, line: int, column: int, text: str, expected: str, got: str) -> None:
        super().__init__(f"line {line}, column {column}: expected {expected}, got {got}")
        self.line = line
        self.column = column
        self.as_reported = f"syntax_error_on_line:{line}:{text}:"


class ScriptNameError(ScriptError):
    """The program uses a name that nothing has; found before it runs.

    Attributes:
        line: Where, counted from one.
        column: Where on that line, counted from one.
        as_reported: What a robot says of it on the primary port.
    """

    def __init__(self, name: str, *, line: int, column: int) -> None:
        super().__init__(
            f"line {line}, column {column}: '{name}' is not defined in the program, nor built in at this version"
        )
        self.line = line
        self.column = column
        self.as_reported = f"compile_error_name_not_found:{name}:"


class ScriptRuntimeError(ScriptError):
    """The running script did what a robot stops for; the interpreter knows the place."""


class ScriptFault(msgspec.Struct, frozen=True, kw_only=True):
    """Why a program ended before its end.

    Attributes:
        message: What was expected and what came.
        line: Where the statement that was being executed begins.
        column: Where on that line, counted from one.
        thread: The name of the thread that executed it; the program's own name for its main thread.
    """

    message: str
    line: int
    column: int
    thread: str
