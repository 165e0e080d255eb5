"""What a robot node does with the help of a person at the arm, which may take an hour: one thing at a time. State.

Nobody waits so long for an answer that may be lost on the way. Whoever asked is told that it is under way, and asks
again under the same number until it is done.
"""

from typing import Protocol

import msgspec

from robot.bus.station_rows import (
    Arm,
    ArmableWork,
    ClearLatch,
    Engage,
    Failed,
    LayOut,
    ResetPlant,
    StationAsk,
    StationReport,
    StationTold,
)
from robot.errors import BugError, RobotError
from robot.safety import Armable

__all__ = ["AtTheArm", "Errand", "failed_by", "is_errand", "is_his"]


class AtTheArm(Protocol):
    """A person who arms this arm, and nobody else does."""

    def arm(self, station: Armable) -> None:
        """Arm it when the person says so. Raises SafetyError where nobody is there, or the answer is wrong."""
        ...

    def look(self, station: Armable) -> None:
        """Let the person find out why it latched, and see to it."""
        ...

    def clear(self, station: Armable) -> None:
        """Clear the latch when the person says so."""
        ...


def is_errand(request: StationAsk) -> bool:
    """Tell whether a person at the arm is needed for it, or command is taken from there."""
    return isinstance(request.work, Arm | Engage | ResetPlant | ClearLatch | LayOut)


def is_his(work: ArmableWork, station: Armable, person: AtTheArm) -> bool:
    """Have the person at the arm do what only he may, and tell whether it was that; what else there is to do is not."""
    match work:
        case Arm():
            person.arm(station)
        case ClearLatch():
            person.clear(station)
        case ResetPlant():
            person.look(station)
            return False
        case _:
            return False
    return True


def failed_by(error: RobotError) -> Failed:
    """Return an error as it crosses the bus."""
    assert not isinstance(error, BugError), str(error)
    return Failed(kind=type(error).__name__, message=str(error))


class Errand:
    """The one that is under way, or was done last."""

    def __init__(self) -> None:
        self._request: StationAsk | None = None
        self._told: StationTold | None = None

    @property
    def what(self) -> str:
        """In words, empty where none is under way."""
        return "" if self._request is None or self._told is not None else type(self._request.work).__name__

    def begin(self, request: StationAsk) -> None:
        """Note that it is under way."""
        self._request, self._told = request, None

    def end(self, told: StationTold) -> None:
        """Note what came of it."""
        self._told = told

    def is_this(self, request: StationAsk) -> bool:
        """Tell whether it is the one that is under way, or was done last: its answer is asked for once more."""
        mine = self._request
        return mine is not None and bool(mine.lease) and mine == request

    def told(self, report: StationReport) -> StationTold:
        """Return what came of it, or that it is under way."""
        if self._told is None:
            return StationTold(report=report, is_pending=True)
        return msgspec.structs.replace(self._told, report=report)
