"""What of a percept whoever keeps the arm clear of things must know: where they are, and which is in the hand."""

import math

import msgspec

from config.scenario import Scenario
from robot.messages import ObjectPercept, Percept, Quat, Vec3

__all__ = ["HELD_M", "Lookout", "Place", "Surroundings"]

HELD_M = 0.035
"""What a full hand holds has its centre this near the tool centre point."""
TINY = 1e-6


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Where one thing was perceived, base frame."""

    position_m: Vec3
    quat: Quat


class Surroundings(msgspec.Struct, frozen=True, kw_only=True):
    """The things of one scenario as one percept has them: its buttons, boxes and cylinders, in this order."""

    stamp_ns: int
    """The percept's."""
    places: tuple[Place | None, ...]
    """None where a thing is not perceived now."""
    is_hand_full: bool = False
    held: int | None = None
    """Which of them is in a full hand, where that is perceived."""


class Lookout:
    """Takes from percepts what is handed down with a time step.

    Args:
        scenario: which things there are.
        max_age_s: a thing that was seen longer ago is not perceived now.
    """

    def __init__(self, scenario: Scenario, *, max_age_s: float) -> None:
        fixed = (*scenario.buttons, *scenario.boxes)
        self._names = tuple(thing.name for thing in (*fixed, *scenario.cylinders))
        self._loose = range(len(fixed), len(self._names))
        self._max_age_s = max_age_s

    def see(self, percept: Percept) -> Surroundings:
        """Return what a percept says of the things of the scenario, and of nothing else."""
        by_name = {thing.name: thing for thing in percept.objects}
        places = tuple([self._place(by_name.get(name)) for name in self._names])
        is_full = percept.grip.has_object
        held = self._nearest(percept.tcp_position_m, places) if is_full else None
        return Surroundings(stamp_ns=percept.stamp_ns, places=places, is_hand_full=is_full, held=held)

    def _place(self, thing: ObjectPercept | None) -> Place | None:
        if thing is None or not thing.is_valid or not thing.age_s <= self._max_age_s:
            return None
        size = math.hypot(*thing.quat)
        if not (math.isfinite(sum(thing.position_m)) and TINY < size < math.inf):
            return None
        return Place(position_m=thing.position_m, quat=thing.quat)

    def _nearest(self, tool_m: Vec3, places: tuple[Place | None, ...]) -> int | None:
        near = [(math.dist(p.position_m, tool_m), i) for i in self._loose if (p := places[i]) is not None]
        distance, i = min(near, default=(math.inf, 0))
        return i if distance < HELD_M else None
