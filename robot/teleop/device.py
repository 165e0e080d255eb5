"""What a driver's device says, whichever it is: one stamped message, and the door behind which devices are."""

from collections.abc import Callable
from enum import StrEnum
from typing import Protocol

import msgspec

from robot.errors import RobotConfigError
from robot.messages import Grip, Vec3
from robot.rigs import load

__all__ = ["DEVICES", "Device", "DriverInput", "EpisodeKey", "Frame", "MissingExtraError", "open_device"]

DEVICES = {
    "keyboard": "robot.teleop.keyboard:Keyboard",
    "gamepad": "robot.teleop.gamepad:Gamepad",
    "spacemouse": "robot.teleop.spacemouse:SpaceMouse",
    "script": "robot.teleop.script:ScriptedDevice",
}
"""Devices by name; what follows a colon, as in `script:FILE`, is handed to the device."""
EXTRAS = {"gamepad": "gamepad", "spacemouse": "spacemouse"}


class MissingExtraError(RobotConfigError):
    """A device needs a library that is not installed."""


class Frame(StrEnum):
    """Whose axes a driver moves along."""

    BASE = "base"
    TOOL = "tool"


class EpisodeKey(StrEnum):
    """What a driver says of the episode in hand, once."""

    NEXT = "next"
    """It is kept; the next one, please."""
    REDO = "redo"
    """It is not kept; the same table once more."""
    DISCARD = "discard"
    """It is not kept; another table."""


class DriverInput(msgspec.Struct, frozen=True, kw_only=True):
    """What a driver asks at one instant. Directions are shares of full speed, each from -1 to 1."""

    stamp_ns: int
    """When the device last said so, in the driver's own time."""
    linear: Vec3 = (0.0, 0.0, 0.0)
    angular: Vec3 = (0.0, 0.0, 0.0)
    is_held: bool = False
    """The driver holds something down that means `move`; without it nothing does (hold-to-run)."""
    is_clutched: bool = False
    """Stick and arm are apart: the device may be moved, the arm rests."""
    grip: Grip | None = None
    """What the driver last asked of the hand; None where nothing yet."""
    speed_share: float = 1.0
    """Share of full speed that the driver chose."""
    frame: Frame = Frame.BASE
    is_over: bool = False
    """The driver is done."""
    episode: EpisodeKey | None = None
    """What is said of the episode in hand, in the one look at the device that first sees it."""


class Device(Protocol):
    """Something a person drives with."""

    @property
    def name(self) -> str:
        """What a lease and a person call it."""
        ...

    @property
    def keys(self) -> tuple[tuple[str, str], ...]:
        """What does what, for the read-out: a key or stick, and what it does."""
        ...

    def connect(self) -> None:
        """Acquire it. Raises RobotError where it is not there. May be called again after close()."""
        ...

    def read(self) -> DriverInput:
        """Return what it says now; never waits."""
        ...

    def close(self) -> None:
        """Give it back as it was. Idempotent, never raises."""
        ...


def open_device(spec: str, *, now_ns: Callable[[], int], step_s: float) -> Device:
    """Return the device that a name such as `keyboard` or `script:FILE` stands for, not yet connected to.

    Args:
        spec: a name of DEVICES, and after a colon what it is told.
        now_ns: the driver's time.
        step_s: how long it is between two looks at a device.

    Raises:
        RobotConfigError: there is no such device.
        MissingExtraError: its library is not installed.
    """
    name, _, detail = spec.partition(":")
    if name not in DEVICES:
        raise RobotConfigError(f"--device: expected one of {', '.join(DEVICES)}, came {name!r}")
    return load(DEVICES[name])(detail=detail, now_ns=now_ns, step_s=step_s)


def missing_extra(name: str, library: str) -> MissingExtraError:
    """Return the error that says which extra brings a device's library."""
    return MissingExtraError(
        f"device {name}: expected the library {library}, it is not installed: pip install 'autotelic[{EXTRAS[name]}]'"
    )
