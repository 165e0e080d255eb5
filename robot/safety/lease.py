"""Who may command one arm: one source at a time, for as long as it says that it is there. State of one arm."""

from collections.abc import Callable

import msgspec

from robot.errors import SafetyError

__all__ = ["Lease", "LeaseBook"]


class Lease(msgspec.Struct, frozen=True, kw_only=True):
    """One source's right to command."""

    source: str
    number: int
    """Never given twice: a lease that ended cannot be mistaken for its successor."""
    life_ns: int | None
    """Without a renewal for longer than this it ends; None for a source that cannot vanish without its station."""


class LeaseBook:
    """Gives the lease of one arm. It expires by one clock, the monotonic one of the process that holds the book.

    Args:
        now_ns: that clock.
    """

    def __init__(self, *, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._lease: Lease | None = None
        self._renewed_ns = 0
        self._n_given = 0

    @property
    def current(self) -> Lease | None:
        """The lease in force; None where nobody has one or it has expired."""
        lease = self._lease
        return lease if lease is not None and not self._is_expired(lease) else None

    def take(self, source: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to a source.

        Raises:
            SafetyError: another source has it, or the source has no name.
        """
        if not source:
            raise SafetyError("a lease: expected the name of its source, came none")
        now = self.current
        if now is not None and now.source != source:
            raise SafetyError(f"a lease for {source}: {now.source} has it; it must be handed over or let go of first")
        return self._give(source, life_ns)

    def renew(self, lease: Lease) -> None:
        """Say that its source is still there.

        Raises:
            SafetyError: it is not the lease in force, or it has expired; it must be taken anew.
        """
        self._require(lease)
        self._renewed_ns = self._now_ns()

    def revive(self, lease: Lease) -> None:
        """Take up again a lease that may have expired while nothing was engaged under it.

        Raises:
            SafetyError: another was given since.
        """
        if self._lease != lease:
            self._require(lease)
        self._renewed_ns = self._now_ns()

    def hand_over(self, lease: Lease, to: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to another source; what was armed for the old one is so no longer.

        Raises:
            SafetyError: it is not the lease in force, it has expired, or the other source has no name.
        """
        self._require(lease)
        if not to:
            raise SafetyError("a hand-over: expected the name of the source that takes over, came none")
        return self._give(to, life_ns)

    def release(self, lease: Lease) -> None:
        """Let go of it. A lease that has ended already is left alone."""
        if self._lease == lease:
            self._lease = None

    def is_in_force(self, lease: Lease) -> bool:
        """Whether this lease may be commanded under."""
        return self.current == lease

    def _give(self, source: str, life_ns: int | None) -> Lease:
        self._n_given += 1
        self._lease = Lease(source=source, number=self._n_given, life_ns=life_ns)
        self._renewed_ns = self._now_ns()
        return self._lease

    def _require(self, lease: Lease) -> None:
        if self._lease != lease:
            by = "nobody" if self._lease is None else self._lease.source
            raise SafetyError(f"the lease {lease.number} of {lease.source} has ended; {by} has it now")
        if self._is_expired(lease):
            raise SafetyError(f"the lease {lease.number} of {lease.source} has expired: nothing was heard in its time")

    def _is_expired(self, lease: Lease) -> bool:
        return lease.life_ns is not None and not 0 <= self._now_ns() - self._renewed_ns <= lease.life_ns
