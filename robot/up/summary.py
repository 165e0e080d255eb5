"""What a supervised run came to: who was started how often, what went wrong, and how bad the worst of it was. Pure."""

from enum import IntEnum

import msgspec

from robot.up.clocks import ClockOffset

__all__ = ["Event", "NodeSummary", "Summary", "Worst"]


class Worst(IntEnum):
    """The worst thing that happened, as an exit code."""

    NOTHING = 0
    FAILED = 1
    """A process was given up, the job failed, or a stop was not confirmed."""
    MENDED = 3
    """A process ended or froze, and was started again."""


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """Something worth telling."""

    at_s: float
    """Since the supervisor began."""
    node: str
    what: str


class NodeSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One process."""

    name: str
    n_starts: int
    exit_code: int | None
    most_late_ms: float
    most_mb: float
    grown_mb: float
    """Greatest memory less what it first told of, over all its starts."""
    slope_mb_h: float | None = None
    """How fast its memory grew once it had been up for half a minute; None where it never was."""
    last_error: str


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """All of it."""

    rig: str
    seconds: float
    exit_code: int
    nodes: tuple[NodeSummary, ...]
    events: tuple[Event, ...]
    stop_first_ms: float | None
    """Until the stop at the end's beginning was confirmed; None where it was not."""
    stop_last_ms: float | None
    """The same, before the arm was let go of."""
    logs: str
    clocks: tuple[ClockOffset, ...] = ()
    """Of all processes on the bus that answered at the end, those of other machines among them."""
