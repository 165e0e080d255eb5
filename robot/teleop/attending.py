"""Who attends while an arm is moved by a list: is told what comes, and says go on or no more. The edge."""

import select
import sys
from typing import Protocol

import typer

from config.rig import Rig
from robot.errors import SafetyError
from robot.person import PersonOperator
from robot.rigs import build_operator
from robot.safety import Operator

__all__ = ["Attendant", "NobodyAsked", "TerminalAttendant", "attending"]


class Attendant(Protocol):
    """Somebody who stands by."""

    def tell(self, text: str) -> None:
        """Say something."""
        ...

    def ask(self, text: str) -> None:
        """Ask whether to go on; what was said before counts no more."""
        ...

    def heard(self) -> str | None:
        """Return the answer, None while there is none. Never waits. Raises SafetyError where nobody is there."""
        ...


class TerminalAttendant:
    """Implements Attendant at a terminal."""

    def tell(self, text: str) -> None:
        """Print a line."""
        typer.echo(text, err=True)

    def ask(self, text: str) -> None:
        """Print a question; what was typed ahead of it is thrown away."""
        import termios  # a terminal is there, or nobody would be asked

        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
        typer.echo(f"{text}: Enter moves, n ends the list ... ", err=True, nl=False)

    def heard(self) -> str | None:
        """Return the line that was typed since, None while there is none.

        Raises:
            SafetyError: the input has ended.
        """
        if not select.select([sys.stdin], [], [], 0.0)[0]:
            return None
        line = sys.stdin.readline()
        if not line:
            raise SafetyError("expected a person at the arm, the input has ended: nobody attends, nothing moves on")
        return line.strip().lower()


class NobodyAsked:
    """Implements Attendant where no hardware is attached and nobody is there: it is told, and goes on."""

    def tell(self, text: str) -> None:
        """Print a line."""
        typer.echo(text, err=True)

    def ask(self, text: str) -> None:
        """Print what comes."""
        typer.echo(f"{text}: a virtual arm, nobody is asked", err=True)

    def heard(self) -> str | None:
        """Go on."""
        return ""


def attending(rig: Rig, *, is_terminal: bool) -> tuple[Operator, Attendant]:
    """Return who arms a rig's station, and who attends.

    Args:
        rig: whose arm is moved.
        is_terminal: somebody may sit at this process's terminal.

    Raises:
        SafetyError: a person must, and there is no terminal.
    """
    operator = build_operator(rig) or PersonOperator()
    if is_terminal:
        return operator, TerminalAttendant()
    if isinstance(operator, PersonOperator) or rig.expected.kind != "virtual":
        raise SafetyError(
            "--probe: expected a person at a terminal, who looks at the arm and is asked before each move; standard "
            "input is none. Nothing was connected to, nothing moves"
        )
    return operator, NobodyAsked()
