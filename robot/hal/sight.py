"""The door for whoever looks at an arm and cannot move it: no command is taken, nothing is written, no program sent."""

from typing import Protocol, runtime_checkable

import msgspec

from robot.messages import ArmMode, PlantIdentity, Vec3, Vec6

__all__ = ["Observer", "Sight", "Watched"]


class Sight(msgspec.Struct, frozen=True, kw_only=True):
    """What an arm measured, as somebody saw who only looks."""

    seen_ns: int
    """When it was read, host's monotonic time."""
    plant_s: float
    """The controller's own time."""
    q_rad: Vec6
    qd_rad_s: Vec6
    tcp_m: Vec3
    """As the controller tells it, by the tool that is set on it."""
    tcp_speed_m_s: Vec3
    digital_out: int
    """Bit i is output i."""
    mode: ArmMode
    is_program_running: bool
    """Somebody's program runs on the arm's controller, or is about to."""


class Observer(Protocol):
    """One arm, looked at. Making one acquires nothing."""

    @property
    def identity(self) -> PlantIdentity:
        """Which arm this is, from connect() on."""
        ...

    @property
    def tool_off_m(self) -> float:
        """How far the arm's own kinematics bring the tool from where the arm's file does, where it stands and home."""
        ...

    def connect(self) -> None:
        """Begin to look, and check that this is the arm of the file. Moves nothing, stops nothing, writes nothing.

        Raises RobotError where nobody answers or it is another arm.
        """
        ...

    def see(self) -> Sight:
        """Return the newest that was measured. Raises StaleStateError where that is too old."""
        ...

    def close(self) -> None:
        """Look no more. Idempotent, never raises."""
        ...


@runtime_checkable
class Watched(Protocol):
    """A plant whose arm can be looked at by others than whoever holds it."""

    def observer(self) -> Observer:
        """Return somebody who looks, not yet connected."""
        ...
