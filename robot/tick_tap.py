"""Who may listen to every tick of an arm. Nothing that it does comes back."""

from typing import Protocol

from robot.messages import ArmCommand, ArmState, Verdict

__all__ = ["BothTaps", "TickTap"]


class TickTap(Protocol):
    """Told of each tick, by whoever holds the arm; never raises, never waits."""

    def measured(self, state: ArmState) -> None:
        """Take note of a measurement; the same may come twice."""
        ...

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Take note of what was requested, what shaped it on its way, and the refusal; None where it was sent."""
        ...

    def refused(self, verdict: Verdict) -> None:
        """Take note of a refusal that was of no command: of an intent, of a wire."""
        ...


class BothTaps:
    """Implements TickTap: tells one after another.

    Args:
        first: is told first.
        second: is told then.
    """

    def __init__(self, first: TickTap, second: TickTap) -> None:
        self._first, self._second = first, second

    def measured(self, state: ArmState) -> None:
        """Tell a measurement."""
        self._first.measured(state)
        self._second.measured(state)

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Tell a command."""
        self._first.commanded(command, limiters, verdict)
        self._second.commanded(command, limiters, verdict)

    def refused(self, verdict: Verdict) -> None:
        """Tell a refusal."""
        self._first.refused(verdict)
        self._second.refused(verdict)
