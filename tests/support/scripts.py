"""Runs a script on builtins that write down when they were called."""

from collections.abc import Generator, Mapping

from sim_twin.controller.script import Builtin, Interpreter, Status, Value, parse_program
from sim_twin.controller.script.builtins import PURE, Popup, message_builtins, time_builtins

SLICE_S = 0.002


class Log:
    """Messages in a list; a popup stays open for some questions."""

    def __init__(self, n_open: int = 0) -> None:
        self.lines: list[str] = []
        self.popups: list[Popup] = []
        self._n_open = n_open

    def log(self, text: str) -> None:
        self.lines.append(text)

    def show(self, popup: Popup) -> None:
        self.popups.append(popup)

    def is_popup_open(self) -> bool:
        self._n_open -= 1
        return self._n_open >= 0


class ScriptRun:
    """One program and what it did.

    `note(...)` writes down its arguments, `move(name, n)` takes n slices and notes its begin and end.

    Attributes:
        notes: The arguments of every call of note, one argument by itself.
        slices: In which slice, counted from one, each was made.
    """

    def __init__(
        self,
        text: str,
        *,
        slice_budget: int = 20_000,
        variables: Mapping[str, Value] | None = None,
        log: Log | None = None,
        costs: Mapping[str, int] | None = None,
        **builtins: Builtin,
    ) -> None:
        self.notes: list[object] = []
        self.slices: list[int] = []
        self.n_slices = 0
        self.log = log or Log()
        offered = {**PURE, **time_builtins(slice_s=SLICE_S), **message_builtins(self.log)}
        offered |= {"note": self._note, "move": self._move, "fail": self._fail, **builtins}
        program = parse_program(text)
        self.interpreter = Interpreter(program, offered, slice_budget=slice_budget, variables=variables, costs=costs)

    def step(self, n: int = 1) -> "ScriptRun":
        for _ in range(n):
            self.n_slices += 1
            self.interpreter.step()
        return self

    def finish(self, n_max: int = 200) -> "ScriptRun":
        while self.interpreter.status is Status.RUNNING and self.n_slices < n_max:
            self.step()
        return self

    @property
    def by_slice(self) -> list[tuple[int, object]]:
        return list(zip(self.slices, self.notes, strict=True))

    def _note(self, *values: Value) -> Value:
        self.slices.append(self.n_slices)
        self.notes.append(values[0] if len(values) == 1 else values)
        return None

    def _move(self, name: Value, n: Value = 1) -> Generator[None, None, Value]:
        self._note(f"{name} begins")
        try:
            for _ in range(n if type(n) is int else 0):
                yield
        finally:
            self._note(f"{name} ends")
        return name

    def _fail(self, *, message: Value = "broken") -> Value:
        raise ValueError(message)


def notes_of(body: str, **builtins: Builtin) -> list[object]:
    """Run statements to their end and return what they noted."""
    run = ScriptRun(program(body), **builtins).finish()
    assert run.interpreter.status is Status.FINISHED, run.interpreter.error
    return run.notes


def value_of(expression: str) -> object:
    """Return what an expression evaluates to."""
    return notes_of(f"note({expression})")[0]


def error_of(body: str, **builtins: Builtin) -> tuple[str, int]:
    """Run statements, the first on line 1, until they fail, and return the message and the line; time is no matter."""
    run = ScriptRun(body, slice_budget=200_000, **builtins).finish()
    assert run.interpreter.status is Status.FAILED, "it did not fail"
    assert run.interpreter.error is not None
    return run.interpreter.error.message, run.interpreter.error.line


def program(body: str) -> str:
    """Make statements a program; its name is on line 1, they begin on line 2."""
    return f"def prog():\n{body}\nend\n"


def schedule(body, n_max=50, **builtins):
    """Return what a body notes, each with its slice."""
    run = ScriptRun(program(body), **builtins).finish(n_max)
    assert run.interpreter.error is None
    return run.by_slice
