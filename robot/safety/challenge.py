"""A question that only somebody at the cell can answer, in time and once. State of one station's arming.

The cell shows a code, on the pendant or on the console beside it; who is there types it, or gives it by a wired input.
The answer is no message: it has no encoding, so that no bus can carry it.
"""

import hmac
import secrets
from collections.abc import Callable
from enum import StrEnum

from robot.errors import SafetyError

__all__ = ["LIFE_NS", "Answer", "AnsweredBy", "Challenges", "draw_code"]

LIFE_NS = 10_000_000_000
"""From when the cell shows a code to when its answer is worth nothing any more."""
N_DIGITS = 4


class AnsweredBy(StrEnum):
    """How an answer came."""

    CONSOLE = "console"
    WIRED = "wired input"


class Answer:
    """What somebody at the cell answered. Not a Struct on purpose: it cannot be encoded, so no bus can carry it.

    Attributes:
        by: How it came.
    """

    __slots__ = ("_text", "by")

    def __init__(self, text: str, *, by: AnsweredBy) -> None:
        self._text, self.by = text, by

    def __repr__(self) -> str:
        return f"Answer(by={self.by.value!r})"

    def is_code(self, code: str) -> bool:
        """Whether this is the code; takes as long for any answer of a length."""
        return hmac.compare_digest(self._text.strip().encode(), code.encode())


class Challenges:
    """Asks, one question at a time. An answer is taken once, whatever it says; a wrong one ends the question too.

    Args:
        now_ns: the monotonic clock of the process that holds the station.
        draw: a fresh code.
    """

    def __init__(self, *, now_ns: Callable[[], int], draw: Callable[[], str]) -> None:
        self._now_ns, self._draw = now_ns, draw
        self._open: tuple[str, str, int] | None = None

    def ask(self, about: str) -> str:
        """Return a fresh code for the cell to show. A question that was still open is so no longer.

        Args:
            about: what the answer will be worth something for: source, profile, lease and mode of the station.
        """
        code = self._draw()
        self._open = (code, about, self._now_ns())
        return code

    def redeem(self, answer: Answer | None, about: str) -> None:
        """Take an answer, once.

        Raises:
            SafetyError: nothing was asked, or it was asked about something else; it is late, or wrong.
        """
        asked, self._open = self._open, None
        if asked is None:
            raise SafetyError("an answer to what the cell shows: nothing was asked, or it was answered already")
        code, asked_about, asked_ns = asked
        if answer is None or not answer.is_code(code):
            raise SafetyError("expected the code that the cell shows, came another: ask again, the code is used up")
        if asked_about != about:
            raise SafetyError(f"the code was shown for {asked_about}, now it would be for {about}: ask again")
        if not 0 <= self._now_ns() - asked_ns <= LIFE_NS:
            raise SafetyError(f"expected the answer within {LIFE_NS / 1e9:g} s of the code, it came later: ask again")


def draw_code() -> str:
    """Return digits that nobody can foresee."""
    return f"{secrets.randbelow(10**N_DIGITS):0{N_DIGITS}d}"
