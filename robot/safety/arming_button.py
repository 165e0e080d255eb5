"""A button at the cell, wired to an input of the arm, whose press answers what the cell shows. State of one input.

A press counts if it begins after the question: the input must be seen off first, then on, each for longer than a
contact bounces. One that is held down, tied up or stuck answers nothing, nor does one that was not looked at meanwhile.
"""

from collections.abc import Callable

from robot.errors import SafetyError
from robot.safety.challenge import LIFE_NS, Answer, AnsweredBy

__all__ = ["GAP_NS", "SETTLE_NS", "ArmingButton", "PressWatch"]

SETTLE_NS = 30_000_000
"""For how long a contact must keep its level to count as having it: good ones bounce for 5 ms, worn ones for 20."""
GAP_NS = 250_000_000
"""Looks farther apart say nothing of what was between them. A look at an arm that rests takes up to 50 ms."""


class PressWatch:
    """Sees one press: off for long enough, then on for long enough."""

    def __init__(self) -> None:
        self._is_on = False
        self._since_ns = self._last_ns = 0
        self._is_seen = self._was_released = False

    def see(self, *, is_on: bool, now_ns: int) -> bool:
        """Take in one look and return whether the button has been pressed by now."""
        if not self._is_seen or not 0 <= now_ns - self._last_ns <= GAP_NS:
            self._is_seen, self._was_released = True, False
            self._is_on, self._since_ns = is_on, now_ns
        elif is_on != self._is_on:
            self._is_on, self._since_ns = is_on, now_ns
        self._last_ns = now_ns
        is_settled = now_ns - self._since_ns >= SETTLE_NS
        if is_settled and not is_on:
            self._was_released = True
        return is_settled and is_on and self._was_released


class ArmingButton:
    """Answers a station's challenge by a wired input, once, in its time.

    Args:
        signal: number of the input, as ArmState.digital_in has it.
        now_ns: this process's monotonic clock.
    """

    def __init__(self, *, signal: int, now_ns: Callable[[], int]) -> None:
        self._bit, self._now_ns = 1 << signal, now_ns
        self._asked: tuple[str, int] | None = None
        self._watch = PressWatch()

    def ask(self, code: str) -> None:
        """Wait for a press that answers this code; what was asked before is so no longer."""
        self._asked, self._watch = (code, self._now_ns()), PressWatch()

    def see(self, digital_in: int) -> Answer | None:
        """Take in the inputs and return the answer as soon as there is one.

        Raises:
            SafetyError: nothing was asked, or it was answered already; or nobody has pressed in time.
        """
        if self._asked is None:
            raise SafetyError("a press of the arming button: nothing was asked, or it was answered already")
        code, asked_ns = self._asked
        now_ns = self._now_ns()
        if now_ns - asked_ns > LIFE_NS:
            self._asked = None
            raise SafetyError(
                f"expected the arming button released and pressed within {LIFE_NS / 1e9:g} s, it was not: ask again"
            )
        if not self._watch.see(is_on=bool(digital_in & self._bit), now_ns=now_ns):
            return None
        self._asked = None
        return Answer(code, by=AnsweredBy.WIRED)
