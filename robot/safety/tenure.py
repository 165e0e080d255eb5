"""What one station is armed for, kept true: its arming held to the lease in force. State of one station."""

from collections.abc import Callable

from robot.errors import SafetyError
from robot.safety.arming import Arming, Grant
from robot.safety.lease import Lease, LeaseBook

__all__ = ["LOCAL", "Tenure"]

LOCAL = "local"
"""The source that has the lease where nobody has taken it: whoever holds the station in this process."""


class Tenure:
    """The lease of a station's arm, and the grant that comes of it.

    Args:
        arming: disarmed as soon as what it was armed for is gone.
        profile: of the limits that are held.
        now_ns: this process's monotonic clock, by which leases expire.
    """

    def __init__(self, *, arming: Arming, profile: str, now_ns: Callable[[], int]) -> None:
        self._arming, self._profile = arming, profile
        self._book = LeaseBook(now_ns=now_ns)
        self._lease: Lease | None = None

    @property
    def grant(self) -> Grant | None:
        """What there is to be armed for now; None where no lease is in force."""
        lease = self._lease
        if lease is None or not self._book.is_in_force(lease):
            return None
        return Grant(source=lease.source, profile=self._profile, lease=lease.number)

    def take(self, source: str, *, life_ns: int | None) -> Lease:
        """Give the lease to a source. Raises SafetyError where another has it."""
        self._lease = self._book.take(source, life_ns=life_ns)
        return self._lease

    def hand_over(self, to: str, *, life_ns: int | None) -> Lease:
        """Give the lease to another source. Raises SafetyError where nobody has it, or it has expired."""
        if self._lease is None:
            raise SafetyError("a hand-over: expected a source that has the lease, nobody has it")
        self._lease = self._book.hand_over(self._lease, to, life_ns=life_ns)
        return self._lease

    def renewed(self) -> Grant:
        """Return what there is to be armed for, its lease renewed: whoever calls is the source or its operator."""
        if self._lease is None:
            self._lease = self._book.take(LOCAL)
        self._book.revive(self._lease)
        grant = self.grant
        assert grant is not None, "it was just renewed"
        return grant

    def renew(self) -> None:
        """Say that the source is still there; a lease that has ended stays so."""
        if self._lease is not None and self._book.is_in_force(self._lease):
            self._book.renew(self._lease)

    def keep(self) -> None:
        """Say that the source is there and was all the while; where nobody has the lease that says nothing."""
        if self._lease is not None:
            self._book.revive(self._lease)

    def holds(self) -> bool:
        """Disarm where what the station was armed for is gone. Returns False where that took motion away just now."""
        was_engaged = self._arming.is_engaged
        self._arming.hold_to(self.grant)
        return self._arming.is_engaged or not was_engaged

    def end(self) -> None:
        """Let go of the lease, and of the arming but a latch."""
        self._arming.disarm()
        if self._lease is not None:
            self._book.release(self._lease)
            self._lease = None
