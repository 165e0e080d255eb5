"""What an arm's ticks asked for and what safety said, thinned for the bus. State; implements robot.tick_tap.TickTap."""

from collections import deque

import msgspec

from robot.messages import ArmCommand, ArmState, Outcome, Verdict

__all__ = ["NOTE_HZ", "TickNote", "TickNotes"]

NOTE_HZ = 50.0
MOST_NOTES = 64
"""Some more than a time step has; the oldest make room where nobody asks for them."""


class TickNote(msgspec.Struct, frozen=True, kw_only=True):
    """One tick's request, and what became of it."""

    requested: ArmCommand
    verdict: Verdict

    @property
    def is_sent(self) -> bool:
        """Whether it went to the arm."""
        return self.verdict.outcome is not Outcome.REFUSED


class TickNotes:
    """Keeps each so many-th tick, and every one that was refused.

    Args:
        rate_hz: of the ticks.
    """

    def __init__(self, *, rate_hz: float) -> None:
        self._every = max(1, round(rate_hz / NOTE_HZ))
        self._n = 0
        self._notes: deque[TickNote] = deque(maxlen=MOST_NOTES)

    def take(self) -> tuple[TickNote, ...]:
        """Return what was noted since the last time."""
        notes = tuple(self._notes)
        self._notes.clear()
        return notes

    def measured(self, state: ArmState) -> None:
        """Measurements are told by whoever asks for them."""

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Note a tick whose turn it is, or that was refused."""
        self._n += 1
        if verdict is None and self._n % self._every:
            return
        outcome = Outcome.LIMITED if limiters else Outcome.PASSED
        said = verdict or Verdict(
            stamp_ns=command.stamp_ns, sequence=command.sequence, outcome=outcome, reason=" ".join(limiters)
        )
        self._notes.append(TickNote(requested=command, verdict=said))

    def refused(self, verdict: Verdict) -> None:
        """Refusals are told with the time step that they end."""
