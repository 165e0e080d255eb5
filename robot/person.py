"""A person at the terminal: is told things, presses Enter, and arms an arm that nobody else may. The edge."""

import sys
from collections.abc import Callable
from time import sleep
from typing import Protocol

import typer

from robot.errors import SafetyError
from robot.messages import StationMode
from robot.safety.arming import Armable
from robot.safety.challenge import LIFE_NS, Answer, AnsweredBy

__all__ = ["Person", "PersonOperator", "TerminalPerson"]

LOOK_S = 0.01
"""How long between two looks at the arming button."""


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


class TerminalPerson:
    """Implements Person on standard error and standard input."""

    def tell(self, text: str) -> None:
        """Print a line."""
        typer.echo(text, err=True)

    def await_key(self, text: str) -> None:
        """Print a line and wait for Enter.

        Raises:
            SafetyError: the input has ended.
        """
        typer.echo(f"{text}; then Enter: ", err=True)
        self._line("key")

    def ask(self, text: str) -> str:
        """Print a line and return what is typed after it.

        Raises:
            SafetyError: the input has ended.
        """
        typer.echo(f"{text}, then Enter: ", err=True)
        return self._line("word")

    @staticmethod
    def _line(what: str) -> str:
        line = sys.stdin.readline()
        if not line:
            raise SafetyError(
                f"expected a person's {what}, the input has ended: nobody is at the arm, it stays disarmed"
            )
        return line.strip()


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
        identity = station.identity
        self._person.await_key(
            f"the {identity.kind.value} arm {identity.serial} will be taken and may move from now on: stand clear, "
            "hand on the emergency stop"
        )
        station.arm(by=self.name, answer=self._answer(station))
        station.engage()

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: let the person look, lay the table out, and clear the latch when the cell's code is answered.

        Raises:
            SafetyError: the station is not latched, nobody is there, or the answer is wrong or late.
            TooManyLatchesError: the run has latched too often.
        """
        state = station.state
        if state.mode is not StationMode.LATCHED:
            raise SafetyError(f"expected a latched station, it is {state.mode}: nothing to clear")
        self._person.await_key(
            f"the arm was stopped ({state.reason}): find out why, unlock a protective stop at the pendant, lead "
            "the arm clear of the table by hand"
        )
        station.reset_plant(seed=seed, epoch=epoch)
        station.clear_latch(by=self.name, answer=self._answer(station))
        self._person.await_key("the latch is cleared; the arm is taken again next: stand clear")
        station.engage()

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
