"""What motions are, what they need of a measurement, and what they leave behind."""

from collections.abc import Generator
from typing import Protocol

from sim_twin.controller.motion.poses import Array
from sim_twin.controller.motion.servo import ServoFilter

__all__ = ["Motion", "MotionConflictError", "Sensed", "Tail"]

Motion = Generator[None, None, None]


class MotionConflictError(RuntimeError):
    """Two threads of a program moved the arm in one slice."""


class Sensed(Protocol):
    """What motions need of a measurement."""

    @property
    def q_rad(self) -> Array:
        """Joint angles."""
        ...

    @property
    def qd_rad_s(self) -> Array:
        """Joint speeds."""
        ...

    @property
    def wrench(self) -> Array:
        """Force and torque of the world on the tool, at the tool, base axes."""
        ...


class Tail:
    """What goes on after a motion returned.

    Args:
        motion: Resumed once a slice while nobody drives.
        anchor_rad: Where it would come to rest, if the next motion is to begin there (a blend).
        servo: Its filter, if it is servoj's.
    """

    def __init__(self, motion: Motion, *, anchor_rad: Array | None = None, servo: ServoFilter | None = None) -> None:
        self.motion, self.anchor_rad, self.servo = motion, anchor_rad, servo
