"""Which messages of a session tell that an arm was stopped. Holds what was told already; else pure."""

from typing import Any

from robot.bus.station_rows import StationReport, StopAsk
from robot.messages import StationMode, Verdict
from robot.recording.messages import Event, StepMark

__all__ = ["FAILED", "StopsHeard"]

FAILED = ("step failed", "reset failed")
"""Events that end a time step or a reset without a verdict."""
MOST_WORDS = 200


class StopsHeard:
    """Tells the first word of a stop from all that follow it."""

    def __init__(self) -> None:
        self._is_latched = False
        self._asked: int | None = None

    def why(self, message: Any) -> str | None:  # noqa: ANN401 - of any topic
        """Return why the arm was stopped, None where a message tells of no stop, or of none that is new."""
        match message:
            case Verdict(is_latched=True):
                return _words(message)
            case StepMark():
                latched = [verdict for verdict in message.verdicts if verdict.is_latched]
                return _words(latched[0]) if latched else None
            case StopAsk() if message.number != self._asked:
                self._asked = message.number
                return f"stop said by {message.by}"[:MOST_WORDS]
            case StationReport():
                was, self._is_latched = self._is_latched, message.state.mode is StationMode.LATCHED
                return f"latched: {message.state.reason}"[:MOST_WORDS] if self._is_latched and not was else None
            case Event(what=what) if what in FAILED:
                return f"{what}: {message.detail}"[:MOST_WORDS]
            case _:
                return None


def _words(verdict: Verdict) -> str:
    return f"{verdict.reason}: {verdict.detail}"[:MOST_WORDS]
