"""What is known of a lid from what it was asked: nothing measures a leaf."""

import math

from config.scenario import Box
from robot.messages import Vec3
from robot.safety.blocks import LidState

__all__ = ["LidWatch"]

SETTLING_S = 0.3
"""So much longer than its travel at its speed a lid may take."""
HAND_M = 0.055
"""How far the hand reaches aside of the tool centre point."""
TIPS_M, HELD_M = 0.017, 0.03
"""How far fingertips, and what a full hand holds, reach below it. Motion keeps an empty hand out of all that leaves may
sweep and no higher over it than need be: were that hand taken to be in their way, it would wait for them for good."""


class LidWatch:
    """One lid. State: what it was asked last, and since when it may have been on its way.

    Attributes:
        state: What is known of its leaves.
    """

    def __init__(self, box: Box) -> None:
        assert box.lid is not None, "asked before"
        lid = box.lid
        self._bit = 1 << lid.output
        self._travel_ns = round((lid.open_angle_rad / lid.speed_rad_s + SETTLING_S) * 1e9)
        leaf_m = (box.inner_m[0] + box.wall_m) / 2.0
        out_m = leaf_m * max(0.0, -math.cos(lid.open_angle_rad)) + lid.thickness_m + lid.padding_m
        self._rim_m = box.height_m
        self._half_m = (box.inner_m[0] / 2.0 + box.wall_m + out_m, box.inner_m[1] / 2.0 + box.wall_m)
        self._high_m = box.height_m + leaf_m + lid.thickness_m + lid.padding_m
        self._is_open: bool | None = None
        self._since_ns = 0
        self.state = LidState.UNKNOWN

    def seed(self, digital_out: int, now_ns: int) -> None:
        """Take the lid to be as its output says: a reset lays out lids too. One that was on its way still is."""
        is_open = bool(digital_out & self._bit)
        if is_open is self._is_open and self.state is LidState.UNKNOWN and now_ns - self._since_ns < self._travel_ns:
            return
        self._is_open = is_open
        self.state = LidState.OPEN if is_open else LidState.SHUT

    def note(self, digital_out: int, now_ns: int) -> bool:
        """Take note of the outputs of one tick. Returns whether a lid that was known no longer is, or the other way."""
        is_open = bool(digital_out & self._bit)
        before = self.state
        if is_open is not self._is_open:
            self._is_open, self._since_ns, self.state = is_open, now_ns, LidState.UNKNOWN
        elif before is LidState.UNKNOWN and now_ns - self._since_ns >= self._travel_ns:
            self.state = LidState.OPEN if is_open else LidState.SHUT
        return self.state is not before

    def hold_up(self, now_ns: int) -> None:
        """Begin to count anew: something is in the way of leaves that are not known to have arrived."""
        if self.state is LidState.UNKNOWN:
            self._since_ns = now_ns

    def is_hand_in_way(self, from_middle_m: Vec3, *, is_full: bool) -> bool:
        """Return whether the hand may touch the leaves, its tool centre point seen from the table under the box."""
        x, y, z = from_middle_m
        return z < self._high_m + (HELD_M if is_full else TIPS_M) and self._is_over(x, y, HAND_M)

    def is_thing_in_way(self, from_middle_m: Vec3, radius_m: float) -> bool:
        """Return whether a loose thing may: one whose middle is below the rim lies in the box."""
        x, y, z = from_middle_m
        return self._rim_m <= z < self._high_m + radius_m and self._is_over(x, y, radius_m)

    def _is_over(self, x: float, y: float, aside_m: float) -> bool:
        half_x, half_y = self._half_m
        return abs(x) <= half_x + aside_m and abs(y) <= half_y + aside_m
