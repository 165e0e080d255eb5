"""What sticks and pucks say becomes a driver's input: dead zone, fading in after it, edges of buttons. Pure."""

import math

import msgspec

from robot.messages import Grip, Vec3
from robot.teleop.device import DriverInput, Frame

__all__ = ["DEAD_ZONE", "Buttons", "Switches", "beyond_dead_zone"]

DEAD_ZONE = 0.12
"""Share of a stick's way that counts as its middle: worn sticks rest up to a tenth beside it."""


def beyond_dead_zone(share: float) -> float:
    """Return a stick's share with its middle cut out, from 0 at the dead zone's edge to 1: continuous, odd.  -> [-1, 1]

    What is not finite stays so: whoever makes intents of it refuses it.
    """
    if not math.isfinite(share):
        return share
    size = min(abs(share), 1.0)
    return math.copysign(max(0.0, size - DEAD_ZONE) / (1.0 - DEAD_ZONE), share)


class Buttons(msgspec.Struct, frozen=True, kw_only=True):
    """Which of a device's buttons are down."""

    deadman: bool = False
    close: bool = False
    open: bool = False
    frame: bool = False
    clutch: bool = False
    faster: bool = False
    slower: bool = False
    over: bool = False


class Switches:
    """What a device's buttons have switched over so far: each press counts once, on its edge."""

    def __init__(self) -> None:
        self._before = Buttons()
        self._grip: Grip | None = None
        self._frame, self._speed = Frame.BASE, 1.0

    def asked(self, now: Buttons, *, stamp_ns: int, linear: Vec3, angular: Vec3) -> DriverInput:
        """Return the driver's input for buttons and directions as they are now."""
        before, self._before = self._before, now
        if now.close and not before.close:
            self._grip = Grip.CLOSE
        if now.open and not before.open:
            self._grip = Grip.OPEN
        if now.frame and not before.frame:
            self._frame = Frame.TOOL if self._frame is Frame.BASE else Frame.BASE
        if now.faster and not before.faster:
            self._speed = min(1.0, round(self._speed + 0.1, 3))
        if now.slower and not before.slower:
            self._speed = max(0.1, round(self._speed - 0.1, 3))
        return DriverInput(
            stamp_ns=stamp_ns,
            linear=linear,
            angular=angular,
            is_held=now.deadman,
            is_clutched=now.clutch,
            grip=self._grip,
            speed_share=self._speed,
            frame=self._frame,
            is_over=now.over,
        )
