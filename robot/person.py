"""A person at the terminal: is told things, presses Enter, and arms an arm that nobody else may. The edge."""

import os
import secrets
import select
import sys
import termios
from collections.abc import Callable
from time import monotonic, sleep
from typing import Protocol

import typer

from robot.errors import SafetyError
from robot.messages import StationMode
from robot.safety.arming import Armable
from robot.safety.challenge import LIFE_NS, Answer, AnsweredBy

__all__ = ["Person", "PersonOperator", "TerminalPerson", "draw_digits"]

N_TYPED_AHEAD = 3
"""So often keys may come before a question without a word about it."""
LOOK_S = 0.01
"""How long between two looks at the arming button."""
KEY_S = 0.02
"""How long between two looks at the keyboard, where there is something to do meanwhile."""
QUIET_S = 0.3
"""So long nothing may come from the keyboard before a question: what lies on a key answers none."""


class Person(Protocol):
    """Somebody who can be told and asked."""

    def tell(self, text: str) -> None:
        """Say something."""
        ...

    def await_key(self, text: str) -> None:
        """Say what is to be done and wait for a key. Raises SafetyError where nobody is there any more."""
        ...

    def ask(self, text: str) -> str:
        """Ask for a word and return it. Raises SafetyError where nobody is there any more."""
        ...

    def confirm(self, text: str) -> None:
        """Say what is to be done and wait for what a held key cannot type. Raises SafetyError where nobody is there."""
        ...


class TerminalPerson:
    """Implements Person on standard error and standard input.

    Args:
        meanwhile: called again and again while the person is waited for; what it raises ends the waiting. Only what is
            typed after a question answers it then.
        draw: two digits to be typed back.
    """

    def __init__(self, meanwhile: Callable[[], object] | None = None, *, draw: Callable[[], str] | None = None) -> None:
        self._meanwhile, self._draw = meanwhile, draw or draw_digits

    def tell(self, text: str) -> None:
        """Print a line."""
        typer.echo(text, err=True)

    def await_key(self, text: str) -> None:
        """Print a line and wait for Enter.

        Raises:
            SafetyError: the input has ended.
        """
        self._forget_typed()
        typer.echo(f"{text}; then Enter: ", err=True)
        self._line("key")

    def ask(self, text: str) -> str:
        """Print a line and return what is typed after it.

        Raises:
            SafetyError: the input has ended.
        """
        self._forget_typed()
        typer.echo(f"{text}, then Enter: ", err=True)
        return self._line("word")

    def confirm(self, text: str) -> None:
        """Print a line and two digits, and wait until they are typed: the arm moves next, Enter alone is not enough.

        Raises:
            SafetyError: the input has ended.
        """
        while True:
            digits = self._draw()
            typed = self.ask(f"{text}: type {digits}")
            if typed == digits:
                return
            self.tell(f"expected {digits}, came {typed[:20]!r}: the arm waits")

    def _line(self, what: str) -> str:
        line = sys.stdin.readline() if self._meanwhile is None else self._awaited(self._meanwhile)
        if not line:
            raise SafetyError(
                f"expected a person's {what}, the input has ended: nobody is at the arm, it stays disarmed"
            )
        return line.strip()

    def _awaited(self, meanwhile: Callable[[], object]) -> str:
        """Return the next line that is typed, empty where none can come any more."""
        if sys.stdin is None:
            return ""
        keyboard, typed = sys.stdin.fileno(), b""
        while b"\n" not in typed:
            meanwhile()
            if select.select([keyboard], [], [], KEY_S)[0]:
                came = os.read(keyboard, 4096)
                if not came:
                    return ""
                typed += came
        return typed.partition(b"\n")[0].decode(errors="replace") + "\n"

    def _forget_typed(self) -> None:
        """Forget what was typed before a question, which answered another one; go on once no more comes for 0.3 s.

        What lies on a key types on: it is waited for, for as long as it lies there.
        """
        if sys.stdin is None or not (sys.stdin.isatty() or self._meanwhile):
            return
        keyboard = sys.stdin.fileno()
        if os.isatty(keyboard):
            termios.tcflush(keyboard, termios.TCIFLUSH)
        end_s, n_came = monotonic() + QUIET_S, 0
        while monotonic() < end_s:
            if self._meanwhile is not None:
                self._meanwhile()
            if not select.select([keyboard], [], [], KEY_S)[0]:
                continue
            if not os.read(keyboard, 4096):
                return
            end_s, n_came = monotonic() + QUIET_S, n_came + 1
            if n_came == N_TYPED_AHEAD:
                self.tell("something is typing though nothing is asked: is anything lying on the keyboard?")


class PersonOperator:
    """Implements robot.safety.Operator by asking: on any arm, a real one too.

    Where the cell has a button for it, its press is the answer, else a code that is typed.

    Args:
        person: who is asked; whoever is at the terminal where None.
        wait: lets some seconds pass between two looks at the button.
    """

    name = "person at the terminal"

    def __init__(self, person: Person | None = None, *, wait: Callable[[float], object] = sleep) -> None:
        self._person = TerminalPerson() if person is None else person
        self._wait = wait

    def arm_once(self, station: Armable) -> None:
        """Arm and engage a disarmed station when the person says so, and answers what the cell shows."""
        self.arm(station)
        station.engage()

    def arm(self, station: Armable) -> None:
        """Arm a disarmed station when the person says so, and answers what the cell shows."""
        identity = station.identity
        self._person.await_key(
            f"the {identity.kind.value} arm {identity.serial} will be taken and may move from now on: stand clear, "
            "hand on the emergency stop"
        )
        station.arm(by=self.name, answer=self._answer(station))

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: let the person look, lay the table out, and clear the latch when the cell's code is answered.

        Raises:
            SafetyError: the station is not latched, nobody is there, or the answer is wrong or late.
            TooManyLatchesError: the run has latched too often.
        """
        self.look(station)
        station.reset_plant(seed=seed, epoch=epoch)
        self.clear(station)
        station.engage()

    def look(self, station: Armable) -> None:
        """Let the person find out why a station latched, and see to it. Raises SafetyError where it has not."""
        state = station.state
        if state.mode is not StationMode.LATCHED:
            raise SafetyError(f"expected a latched station, it is {state.mode}: nothing to clear")
        self._person.await_key(
            f"the arm was stopped ({state.reason}): find out why, unlock a protective stop at the pendant, lead "
            "the arm clear of the table by hand"
        )

    def clear(self, station: Armable) -> None:
        """Clear a latch when the person answers what the cell shows; the arm is still nobody's after it."""
        station.clear_latch(by=self.name, answer=self._answer(station))
        self._person.confirm("the latch is cleared; the arm is taken again next: stand clear")

    def _answer(self, station: Armable) -> Answer:
        """Let the cell ask, and the person answer. A console shows the code itself only where nothing else can."""
        code = station.challenge()
        if station.has_button:
            return self._await_press(station)
        shown = "the arm's pendant shows a code of digits" if code is None else f"the code is {code}"
        typed = self._person.ask(f"{shown}: type it within {LIFE_NS / 1e9:g} s")
        return Answer(typed, by=AnsweredBy.CONSOLE)

    def _await_press(self, station: Armable) -> Answer:
        """Wait until the button at the cell is pressed. Raises SafetyError where nobody presses it in time."""
        self._person.tell(f"release the arming button at the cell and press it within {LIFE_NS / 1e9:g} s")
        while True:
            answer = station.pressed()
            if answer is not None:
                return answer
            self._wait(LOOK_S)


def draw_digits() -> str:
    """Return two digits that differ: no one key types them, however long it is held."""
    first, step = secrets.randbelow(10), 1 + secrets.randbelow(9)
    return f"{first}{(first + step) % 10}"
