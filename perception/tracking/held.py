"""What the hand holds: it was last seen between the jaws, and goes where the tool goes. State."""

import math
from collections.abc import Mapping

from robot.geometry import rotated
from robot.messages import ArmState, Vec3

__all__ = ["HeldThing"]

IN_HAND_M = 0.040
"""What a full hand holds was last seen with its centre this near the tool centre point."""


class HeldThing:
    """Which loose thing is in the hand, and how it lies there.

    Attributes:
        name: What is held; None where nothing is, or where nobody knows what.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin with a hand that holds nothing known."""
        self.name: str | None = None
        self._offset_m: Vec3 = (0.0, 0.0, 0.0)
        self._was_full = False

    def note(self, arm: ArmState, places_m: Mapping[str, Vec3]) -> str | None:
        """Take in the hand's own word; return what it has let go of.

        Jaws close about the middle between them, so that along their way a held thing has no offset; across and below
        it is where it was seen last.

        Args:
            arm: the newest measurement.
            places_m: where loose things were seen last, those that were.
        """
        is_full, let_go = arm.grip.has_object, None
        if is_full and not self._was_full:
            self.name, self._offset_m = _grasped(arm, places_m)
        elif not is_full:
            let_go, self.name = self.name, None
        self._was_full = is_full
        return let_go

    def position_m(self, arm: ArmState) -> Vec3:
        """Return where the held thing is by now: with the tool."""
        dx, dy, dz = rotated(self._offset_m, arm.tcp_quat)
        x, y, z = arm.tcp_position_m
        return x + dx, y + dy, z + dz


def _grasped(arm: ArmState, places_m: Mapping[str, Vec3]) -> tuple[str | None, Vec3]:
    """Return the thing nearest to the tool, if one is near enough, and its offset in the tool's frame."""
    tool = arm.tcp_position_m
    distance, name = min(((math.dist(tool, at), name) for name, at in places_m.items()), default=(math.inf, ""))
    if distance > IN_HAND_M:
        return None, (0.0, 0.0, 0.0)
    w, x, y, z = arm.tcp_quat
    px, py, pz = (a - b for a, b in zip(places_m[name], tool, strict=True))
    across, _, below = rotated((px, py, pz), (w, -x, -y, -z))
    return name, (across, 0.0, below)
