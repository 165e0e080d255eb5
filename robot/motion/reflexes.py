"""Reflexes of the hand: given, not learnt. State of one hand between resets."""

import math

import msgspec

from config.arm import ArmConfig
from config.scenario import Box, Button, Scenario
from robot.geometry import tool_offset
from robot.messages import Grip, GripCommand, ObjectPercept, Percept, Vec3

__all__ = ["HandReflexes"]

ABOVE_M = 0.008
"""The hand closes when the tool centre point is no higher than this above the object's centre."""
ACROSS_MARGIN_M = 0.003
"""How far inside the pads' edges the object's centre must be: closing stirs it, and past an edge it is squeezed out."""
IN_HAND_M = 0.035
"""What a full hand holds has its centre this near the tool centre point."""
CLEAR_M = 0.03
"""A hand that let go may close again once the object is this far to the side, or half its height below."""
SET_DOWN_M = 0.002
"""A held object this close to the table stands on it."""
LOW_M = 0.002
REACH_TABLE_M = 0.015
"""With the tool held up or as low as it goes, a held object this close to the table is let go."""
DOUBT_S = 0.1
"""A shut hand that reports no object for this long is empty."""
PATIENCE_S = 1.5
"""A hand that has not come to rest by then no longer holds the arm."""


class _Loose(msgspec.Struct, frozen=True):
    """What a reflex must know of one loose thing."""

    name: str
    radius_m: float
    half_height_m: float
    receptacle: Box | None


class HandReflexes:
    """Decides once a step what the hand is asked.

    Attributes:
        wait_at_m: Where the tool was, base frame, when a reflex began to move the fingers: it waits there for them.
            None while they are at rest.
        lost_object: What was held is held no longer although nobody let go.
    """

    def __init__(self, *, arm: ArmConfig, scenario: Scenario) -> None:
        tool = arm.tool
        self._given = scenario.reflexes
        self._stroke_m = tool.stroke_m
        self._across_m = tool.pad_size_m[1] / 2 - ACROSS_MARGIN_M
        self._pad_top_m = tool.pad_size_m[2] - tool.tip_below_tcp_m
        self._yaw_rad = arm.tool_yaw_rad
        self._table_m = scenario.table.height_m
        self._bottom_m = self._table_m + arm.motion.heights_m[0]
        boxes = {box.name: box for box in scenario.boxes}
        self._loose = tuple(
            _Loose(c.name, c.diameter_m / 2, c.height_m / 2, boxes[c.receptacle] if c.receptacle else None)
            for c in scenario.cylinders
        )
        self._fixtures = (*scenario.buttons, *scenario.boxes)
        speed = tool.speed_m_s[1]
        self._open = GripCommand(opening_m=tool.stroke_m, force_n=tool.force_n[0], speed_m_s=speed)
        self._shut = GripCommand(opening_m=0.0, force_n=tool.grip_force_n, speed_m_s=speed)
        self._places: dict[str, int] = {}
        self.reset(None)

    def reset(self, percept: Percept | None) -> None:
        """Start with an open hand that may close on anything."""
        self._command = self._open
        self._held: _Loose | None = None
        self._grasped_at_m = 0.0
        self._was_lifted = False
        self._had_object = False
        self._may_close = True
        self._moved_at_ns = 0
        self._empty_at_ns: int | None = None
        self.wait_at_m: Vec3 | None = None
        self.lost_object = False
        if percept is not None:
            self._places = {thing.name: i for i, thing in enumerate(percept.objects)}

    def decide(self, percept: Percept, asked: Grip | None) -> GripCommand:
        """Return what the hand is asked for the coming step.

        Args:
            percept: What is perceived now.
            asked: What the intent says of the hand; it wins over any reflex.
        """
        self._note(percept)
        if asked is not None:
            self._ask(self._open if asked is Grip.OPEN else self._shut)
            self.wait_at_m = None
            return self._command
        if self._is_waiting(percept):
            return self._command
        if self._command is self._shut:
            self._decide_shut(percept)
        else:
            self._decide_open(percept)
        return self._command

    def _note(self, percept: Percept) -> None:
        """Follow what is held and what has become of it."""
        has_object = percept.grip.has_object
        self.lost_object = self._had_object and not has_object and self._command is self._shut
        if has_object and self._held is None:
            # Closing shifts what is gripped, out of the window in which the hand began to close by a little.
            self._held, self._was_lifted = self._in_hand(percept), False
            self._grasped_at_m = self._height_of(percept, self._held)
        elif not has_object:
            self._held = None
        self._had_object = has_object
        if self._held is not None and self._height_of(percept, self._held) >= self._grasped_at_m + self._given.lift_m:
            self._was_lifted = True
        if not self._may_close and self._command is self._open:
            self._may_close = not any(self._is_near(percept, loose) for loose in self._loose)

    def _is_waiting(self, percept: Percept) -> bool:
        """Whether a reflex's movement of the fingers is still going on."""
        if self.wait_at_m is not None:
            waited_ns = percept.stamp_ns - self._moved_at_ns
            if waited_ns > 0 and (not percept.grip.is_moving or waited_ns > PATIENCE_S * 1e9):
                self.wait_at_m = None
        return self.wait_at_m is not None

    def _decide_open(self, percept: Percept) -> None:
        if not (self._given.close_on_object and self._may_close):
            return
        if self._between_jaws(percept) is not None:
            self._move(self._shut, percept)

    def _decide_shut(self, percept: Percept) -> None:
        if not percept.grip.has_object:
            self._decide_empty(percept)
            return
        self._empty_at_ns = None
        if self._held is None or not self._was_lifted:
            return
        place = self._position_of(percept, self._held)
        if (self._given.open_over_receptacle and self._is_in_receptacle(percept, self._held, place)) or (
            self._given.open_on_table and self._is_on_table(percept, self._held, place)
        ):
            self._move(self._open, percept)

    def _decide_empty(self, percept: Percept) -> None:
        """An empty hand opens again, so that another grasp can follow; a moment's doubt is not loss."""
        if self._empty_at_ns is None:
            self._empty_at_ns = percept.stamp_ns
        elif not percept.grip.is_moving and percept.stamp_ns - self._empty_at_ns >= DOUBT_S * 1e9:
            self._empty_at_ns = None
            self._move(self._open, percept)

    def _move(self, command: GripCommand, percept: Percept) -> None:
        self._ask(command)
        self._moved_at_ns, self.wait_at_m = percept.stamp_ns, percept.tcp_position_m

    def _ask(self, command: GripCommand) -> None:
        if command is self._open and self._command is self._shut:
            self._may_close = False
        self._command = command

    def _between_jaws(self, percept: Percept) -> _Loose | None:
        """The loose thing whose centre lies between the pads, if any; of one that is not perceived now nobody knows."""
        for loose in self._loose:
            if not self._thing(percept, loose.name).is_valid:
                continue
            across, along, below = tool_offset(self._position_of(percept, loose), percept.tcp_position_m, self._yaw_rad)
            if (
                abs(across) <= self._across_m
                and abs(along) <= self._stroke_m / 2 - loose.radius_m
                and -self._pad_top_m <= below <= ABOVE_M
            ):
                return loose
        return None

    def _in_hand(self, percept: Percept) -> _Loose | None:
        """The loose thing nearest the tool centre point, if one is near enough to be what a full hand holds."""
        tool = percept.tcp_position_m
        near = [(math.dist(self._position_of(percept, loose), tool), i) for i, loose in enumerate(self._loose)]
        distance, i = min(near, default=(math.inf, -1))
        return self._loose[i] if distance < IN_HAND_M else None

    def _is_near(self, percept: Percept, loose: _Loose) -> bool:
        across, along, below = tool_offset(self._position_of(percept, loose), percept.tcp_position_m, self._yaw_rad)
        return abs(across) <= CLEAR_M and abs(along) <= self._stroke_m / 2 and below <= loose.half_height_m

    def _is_in_receptacle(self, percept: Percept, held: _Loose, place_m: Vec3) -> bool:
        """The held thing is inside its box's walls and its lower half below the rim."""
        box = held.receptacle
        if box is None:
            return False
        x, y, _ = self._thing(percept, box.name).position_m
        return (
            abs(place_m[0] - x) <= box.inner_m[0] / 2 - held.radius_m
            and abs(place_m[1] - y) <= box.inner_m[1] / 2 - held.radius_m
            and place_m[2] <= self._table_m + box.height_m
        )

    def _is_on_table(self, percept: Percept, held: _Loose, place_m: Vec3) -> bool:
        """The held thing was driven down on the table, clear of every box and button."""
        gap = place_m[2] - held.half_height_m - self._table_m
        is_low = percept.is_in_contact or percept.tcp_position_m[2] <= self._bottom_m + LOW_M
        if gap > SET_DOWN_M and not (is_low and gap <= REACH_TABLE_M):
            return False
        return not any(self._is_over(percept, fixture, held, place_m) for fixture in self._fixtures)

    def _is_over(self, percept: Percept, fixture: Button | Box, held: _Loose, place_m: Vec3) -> bool:
        x, y, _ = self._thing(percept, fixture.name).position_m
        if isinstance(fixture, Box):
            half_x, half_y = (inner / 2 + fixture.wall_m for inner in fixture.inner_m)
        else:
            half_x = half_y = fixture.diameter_m / 2
        return abs(place_m[0] - x) <= half_x + held.radius_m and abs(place_m[1] - y) <= half_y + held.radius_m

    def _thing(self, percept: Percept, name: str) -> ObjectPercept:
        return percept.objects[self._places[name]]

    def _position_of(self, percept: Percept, loose: _Loose) -> Vec3:
        return percept.objects[self._places[loose.name]].position_m

    def _height_of(self, percept: Percept, loose: _Loose | None) -> float:
        return 0.0 if loose is None else self._position_of(percept, loose)[2]
