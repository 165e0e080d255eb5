"""From the text of a program to one that can be stepped; off the loop where there is one."""

import queue
import threading
from collections import deque
from collections.abc import Callable
from typing import Protocol, TypeAlias

import msgspec

from sim_twin.controller.builtins.costs import COSTS
from sim_twin.controller.builtins.secondary import without_motion
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.script import Builtins, Interpreter, ScriptNameError, ScriptSyntaxError, parse_program
from sim_twin.controller.script.builtins import Sockets

__all__ = ["Compiled", "Compiler", "InlineCompiler", "Mistake", "Start", "ThreadCompiler", "compile_text"]

N_WAITING, N_CHARS_WAITING = 1000, 4_194_304
"""Texts that wait for the compiler, and their characters; one more is turned away, or a flood would fill the memory."""
MakeBuiltins = Callable[[Sockets], Builtins]


class Mistake(msgspec.Struct, frozen=True, kw_only=True):
    """Why a text is no program.

    Attributes:
        message: For a person.
        as_reported: As a robot says it on the primary port; empty where a robot has no word for it.
        line: Where, counted from one; 0 where it is no place in the text.
        column: Where on that line.
    """

    message: str
    as_reported: str = ""
    line: int = 0
    column: int = 0


class Compiled:
    """A program that waits for its first slice.

    Attributes:
        name: As its `def` has it; empty for bare statements.
        is_secondary: It runs beside the program.
        interpreter: Ready to step.
        sockets: Its connections.
    """

    def __init__(self, name: str, *, is_secondary: bool, interpreter: Interpreter, sockets: Sockets) -> None:
        self.name, self.is_secondary = name, is_secondary
        self.interpreter, self.sockets = interpreter, sockets

    def close(self) -> None:
        """End it."""
        self.interpreter.stop()
        self.sockets.close()


class Start:
    """What comes of a text that is to start.

    Args:
        n_stops: How many stops had come when it was sent.
        is_remote: It was sent under remote control.
        is_by_hand: Somebody at the arm moves it so.

    Attributes:
        n_stops: As given; a later stop takes it back.
        is_remote: As given; local control takes it back.
        is_by_hand: As given; it begins in the recovery mode too.
        has_begun: Its program has begun, or never will; None while that is not known.
    """

    def __init__(self, *, n_stops: int = 0, is_remote: bool = False, is_by_hand: bool = False) -> None:
        self.n_stops, self.is_remote, self.is_by_hand = n_stops, is_remote, is_by_hand
        self.has_begun: bool | None = None


Done: TypeAlias = tuple[Compiled | Mistake, Start]


class Compiler(Protocol):
    """Takes texts and hands out programs in the same order, each with the start that it was sent with."""

    def submit(self, text: str, start: Start) -> None:
        """Take a text; never wait."""
        ...

    def take(self) -> Done | None:
        """Return the next that is done, or None."""
        ...

    @property
    def is_idle(self) -> bool:
        """There is no text to compile and nothing to take."""
        ...

    def close(self) -> None:
        """Take no more."""
        ...


def compile_text(text: str, make_builtins: MakeBuiltins) -> Compiled | Mistake:
    """Parse and compile one program."""
    try:
        program = parse_program(text)
        sockets = Sockets(slice_s=SLICE_S)
        builtins = make_builtins(sockets)
        allowed = without_motion(builtins) if program.is_secondary else builtins
        interpreter = Interpreter(program, allowed, costs=COSTS)
    except (ScriptSyntaxError, ScriptNameError) as error:
        return Mistake(message=str(error), as_reported=error.as_reported, line=error.line, column=error.column)
    except RecursionError:
        return Mistake(message="the program is nested too deep; use fewer brackets and blocks in one another")
    return Compiled(program.name, is_secondary=program.is_secondary, interpreter=interpreter, sockets=sockets)


class InlineCompiler:
    """Compiles at once: every run is the same, however long it takes."""

    def __init__(self, make_builtins: MakeBuiltins) -> None:
        self._make_builtins = make_builtins
        self._done: deque[Done] = deque()

    def submit(self, text: str, start: Start) -> None:
        """Compile."""
        self._done.append((compile_text(text, self._make_builtins), start))

    def take(self) -> Done | None:
        """Return the next, or None."""
        return self._done.popleft() if self._done else None

    @property
    def is_idle(self) -> bool:
        """There is nothing to take."""
        return not self._done

    def close(self) -> None:
        """Nothing to end."""


class ThreadCompiler:
    """Compiles in a thread of its own, begun with the first text: a script of 40 kB costs ten slices."""

    def __init__(self, make_builtins: MakeBuiltins) -> None:
        self._make_builtins = make_builtins
        self._texts: queue.SimpleQueue[tuple[str, Start] | None] = queue.SimpleQueue()
        self._done: deque[Done] = deque()
        self._thread: threading.Thread | None = None
        self._n_sent = self._n_compiled = 0
        self._n_chars_sent = self._n_chars_compiled = 0
        """Each has one thread that writes it: the first of a pair the loop's, the second the compiler's."""

    def submit(self, text: str, start: Start) -> None:
        """Queue a text."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="compiler", daemon=True)
            self._thread.start()
        n_chars = self._n_chars_sent - self._n_chars_compiled
        if self._texts.qsize() >= N_WAITING or n_chars + len(text) > N_CHARS_WAITING:
            said = f"expected at most {N_WAITING} programs of {N_CHARS_WAITING} characters in all to wait, got one more"
            self._done.append((Mistake(message=said), start))
            return
        self._n_sent += 1
        self._n_chars_sent += len(text)
        self._texts.put((text, start))

    def take(self) -> Done | None:
        """Return the next that is done, or None."""
        return self._done.popleft() if self._done else None

    @property
    def is_idle(self) -> bool:
        """There is no text to compile and nothing to take."""
        return self._n_sent == self._n_compiled and not self._done

    def close(self) -> None:
        """End the thread after what it has."""
        if self._thread is not None:
            self._texts.put(None)
            self._thread.join()
            self._thread = None

    def _work(self) -> None:
        while (sent := self._texts.get()) is not None:
            text, start = sent
            try:
                done = compile_text(text, self._make_builtins)
            except Exception as error:  # noqa: BLE001 - the thread's outermost frame: nobody else would hear of it
                done = Mistake(message=f"the compiler failed: {error!r}")
            self._done.append((done, start))
            self._n_compiled += 1
            self._n_chars_compiled += len(text)
            del sent, text, start, done  # or the last program would live until the next one comes
