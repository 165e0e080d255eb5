"""What a robot node needs of the station that it serves."""

from typing import Protocol

from robot.messages import ArmState, Percept
from robot.safety import Armable, Lease
from robot.station import Station

__all__ = ["Leased", "ServedStation", "Telling"]


class Leased(Protocol):
    """What has a lease."""

    @property
    def lease_number(self) -> int:
        """Of the lease in force; 0 where there is none."""
        ...

    def take_lease(self, source: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to a source. Raises SafetyError where another has it."""
        ...

    def hand_over(self, to: str, *, life_ns: int | None = None) -> Lease:
        """Give the lease to another source; the arm is stopped and disarmed."""
        ...

    def renew_lease(self) -> None:
        """Say that who has the lease is still there; one that has ended stays so."""
        ...

    def keep_lease(self) -> None:
        """Say that who has the lease was heard while nobody could look: one that has run out meanwhile goes on."""
        ...

    def let_go(self) -> None:
        """Let go of the lease: the arm is stopped and disarmed; a latch stays."""
        ...


class Telling(Protocol):
    """What tells of its arm, and can be stopped by anybody."""

    @property
    def model_sha256(self) -> str | None:
        """Digest of the world's model, where it is a simulated one."""
        ...

    @property
    def n_latches(self) -> int:
        """How often it has latched."""
        ...

    @property
    def latch_reasons(self) -> tuple[str, ...]:
        """Why, oldest first."""
        ...

    @property
    def measured(self) -> ArmState:
        """What the arm measured last, once it was engaged."""
        ...

    @property
    def percept(self) -> Percept:
        """What was perceived last, once it was engaged."""
        ...

    def measure(self) -> ArmState:
        """Read the arm, in command of it or not. Moves nothing."""
        ...

    def stop(self, *, by: str) -> None:
        """Stop the arm. Anybody may."""
        ...


class ServedStation(Station, Armable, Leased, Telling, Protocol):
    """All of it; robot.local_station.LocalStation is one."""
