"""Somebody who keeps looking at an arm that stands, or that others move: a thread that looks, and what it looks for."""

from collections.abc import Callable
from threading import Event, Thread
from types import TracebackType
from typing import Self

from robot.errors import ArmRefusedError, RobotError, SafetyError
from robot.hal.sight import Observer, Sight

__all__ = ["STILL_RAD", "StandStill", "Watcher"]

STILL_RAD = 1e-3
"""An arm whose joints stay within this of where they were has not moved."""
END_S = 5.0


class StandStill:
    """Sees to it that an arm stands: its joints stay where they were first seen, and no program begins on it.

    Attributes:
        first: What was seen first; None before.
        farthest_rad: Farthest that a joint came from there.
        n_looks: How often it was looked at.
    """

    def __init__(self) -> None:
        self.first: Sight | None = None
        self.farthest_rad, self.n_looks = 0.0, 0

    def __call__(self, sight: Sight) -> None:
        """Take note of one look.

        Raises:
            ArmRefusedError: a program runs.
            SafetyError: the arm has moved.
        """
        if sight.is_program_running:
            began = "one is running" if self.first is None else "one has begun"
            raise ArmRefusedError(
                f"expected no program on the arm while it is watched, {began}; nothing was sent from here: whoever "
                "started it must stop it"
            )
        if self.first is None:
            self.first = sight
        self.n_looks += 1
        away = [abs(q - q_first) for q, q_first in zip(sight.q_rad, self.first.q_rad, strict=True)]
        still = [q <= STILL_RAD for q in away]  # what is not a number is not
        self.farthest_rad = max(self.farthest_rad, *away)
        if not (all(still) and self.farthest_rad <= STILL_RAD):
            joint = still.index(False) if False in still else max(range(len(away)), key=away.__getitem__)
            raise SafetyError(
                f"expected the arm to stand while it is watched, joint {joint + 1} of {len(away)} moved by "
                f"{1e3 * self.farthest_rad:.1f} mrad (at most {1e3 * STILL_RAD:g} are none); nothing was sent from "
                "here: find out who or what moves it"
            )


class Watcher:
    """Looks at an arm again and again, in a thread, while it is entered.

    Args:
        observer: connected; nobody else may ask it meanwhile.
        take: handed whatever is seen, in that thread; what it raises ends the looking.
        period_s: between two looks.
    """

    def __init__(self, observer: Observer, *, take: Callable[[Sight], object], period_s: float) -> None:
        self._observer, self._take, self._period_s = observer, take, period_s
        self._is_over = Event()
        self._thread = Thread(target=self._run, name="watcher", daemon=True)
        self._error: RobotError | None = None

    def __enter__(self) -> Self:
        """Look once, and begin to look on.

        Raises:
            RobotError: of the first look.
        """
        self._take(self._observer.see())
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._is_over.set()
        self._thread.join(END_S)

    def require(self) -> None:
        """Raise what ended the looking.

        Raises:
            RobotError: the arm could not be seen any more, or what was seen is wrong.
        """
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            while not self._is_over.wait(self._period_s):
                self._take(self._observer.see())
        except RobotError as error:
            self._error = error
