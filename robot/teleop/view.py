"""The door to whatever shows the table while somebody drives; a rig names what does."""

from typing import Protocol

from robot.messages import ArmState, Percept

__all__ = ["View"]


class View(Protocol):
    """A live picture of arm and table, from what is measured and perceived. Never waits, never moves anything."""

    def open(self) -> str:
        """Begin to show, and return where it can be seen. Raises RobotError where it cannot be shown."""
        ...

    def show(self, measured: ArmState, percept: Percept) -> None:
        """Show this from now on."""
        ...

    def close(self) -> None:
        """End it. Idempotent, never raises."""
        ...
