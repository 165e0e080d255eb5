"""Questions to a robot node that may be away for a while: it is started anew, or the bus's hub is.

What needs no lease is asked again until somebody answers. What is asked under one is asked once: a robot node that was
started anew gave no such lease, and one that did has used the question's number up.
"""

from collections.abc import Callable
from time import monotonic, sleep

from robot import errors
from robot.bus.errors import BusError
from robot.bus.queries import Asker
from robot.bus.session import Bus
from robot.bus.station_rows import (
    Arm,
    ClearLatch,
    Describe,
    Engage,
    Failed,
    LayOut,
    ResetPlant,
    StationAsk,
    StationTold,
    Work,
)
from robot.bus.topics import ASK, LAY_OUT
from robot.errors import RobotError, WireError

__all__ = ["NodeAsker", "error_of"]

AGAIN_S = 0.3
_IN_WORDS: dict[type, str] = {
    Arm: "to arm it", Engage: "to take it", ResetPlant: "to see to it and lay the table out",
    ClearLatch: "to clear its latch", LayOut: "to lay the table out",
}  # fmt: skip


def error_of(failed: Failed) -> RobotError:
    """Return the error that the robot node raised, or its nearest kind."""
    kind = getattr(errors, failed.kind, None)
    return kind(failed.message) if isinstance(kind, type) and issubclass(kind, RobotError) else _other(failed)


def _other(failed: Failed) -> RobotError:
    from robot.safety import TooManyLatchesError  # not among robot.errors

    if failed.kind == TooManyLatchesError.__name__:
        return TooManyLatchesError(failed.message)
    return WireError(f"{failed.kind}: {failed.message}")


class NodeAsker:
    """Asks, and asks again where nobody answers.

    Args:
        bus: open.
        wait_s: for how long.
        pause: waits for so many seconds.
        tell: told what a person at the arm is waited for.
    """

    def __init__(
        self, bus: Bus, *, wait_s: float, pause: Callable[[float], object] = sleep,
        tell: Callable[[str], object] = lambda _: None,
    ) -> None:  # fmt: skip
        self._ask, self._lay_out = bus.asker(ASK), bus.asker(LAY_OUT)
        self._wait_s, self._pause, self._tell = wait_s, pause, tell

    def is_anybody(self) -> bool:
        """Ask once whether there is a robot node.

        Raises:
            BusError: there is one that does not answer, or of another version.
        """
        answers: list[StationTold] = []
        self._ask.ask_each(StationAsk(work=Describe()), answers.append)
        return bool(answers)

    def ask(self, work: Work, *, lease: str = "", number: int = 0) -> StationTold:
        """Return what came of it.

        Raises:
            BusError: nobody answers for so long.
            RobotError: what the robot node raised.
        """
        request = StationAsk(work=work, lease=lease, number=number)
        told = self._told(request)
        if told.is_pending:
            self._tell(f"the robot node waits for a person at the arm: {_IN_WORDS[type(work)]}")
        while told.is_pending:
            self._pause(AGAIN_S)
            told = self._told(request, is_known=True)
        if told.failed is not None:
            raise AnsweredError(error_of(told.failed), told)
        return told

    def _told(self, request: StationAsk, *, is_known: bool = False) -> StationTold:
        """Ask until somebody answers; once where a second question would be another one to the robot node."""
        asker: Asker[StationAsk, StationTold] = (
            self._lay_out if isinstance(request.work, LayOut | ResetPlant) else self._ask
        )
        end_s = monotonic() + self._wait_s
        while True:
            answers: list[StationTold] = []
            asker.ask_each(request, answers.append)
            if answers:
                return answers[0]
            is_once = bool(request.lease) and not is_known
            if is_once or monotonic() > end_s:
                within = "" if is_once else f" within {self._wait_s:g} s"
                raise BusError(
                    f"station: expected a robot node that answers{within}, none did; does "
                    "`autotelic up` run, or `autotelic node robot`?"
                )
            self._pause(AGAIN_S)


class AnsweredError(Exception):
    """A robot node answered that it failed; what it told besides is there too."""

    def __init__(self, error: RobotError, told: StationTold) -> None:
        super().__init__(str(error))
        self.error, self.told = error, told
