"""The door to whoever runs cells: processes of this machine, or of others."""

from collections.abc import Sequence
from typing import Protocol

import msgspec

__all__ = ["End", "Executor", "Job"]


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """One start of a cell."""

    name: str
    words: tuple[str, ...]
    """Of the `autotelic` command."""
    memory_mb: int
    """Of more than this it has failed."""


class End(msgspec.Struct, frozen=True, kw_only=True):
    """How a start ended."""

    name: str
    why_failed: str | None
    """In words; None where the command said that it was well."""


class Executor(Protocol):
    """Runs jobs, so many at a time."""

    @property
    def n_slots(self) -> int:
        """How many jobs run at a time."""
        ...

    def start(self, job: Job) -> None:
        """Start a job; there is a slot for it."""
        ...

    def ended(self) -> Sequence[End]:
        """Return the jobs that ended since the last look; never waits."""
        ...

    def ask_to_stop(self) -> None:
        """Ask every job to come to an end that loses nothing."""
        ...

    def close(self) -> None:
        """End whatever still runs, at once. Idempotent."""
        ...
