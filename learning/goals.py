"""Goals, judged on the percept: given knowledge, not learnt. The learner sees indices and these two answers only.

Pressed: the button's lamp is lit. Grabbed: the hand reports an object and the goal's object is between the jaws. In the
box: the object lies within the box's inner walls, below its rim, and the hand does not hold it. An entry of the percept
that is not valid is not judged: such a goal neither holds nor is its place reached.
"""

import math
from collections.abc import Callable

from config.scenario import Goal, GoalKind, Scenario
from learning.interfaces import GoalState
from robot.messages import ObjectPercept, Percept, StationSpec, Vec3

__all__ = ["GoalJudge"]

IN_HAND_M = 0.03
"""An object whose centre is this near the tool centre point of a hand that reports one is the one it holds."""
ABOVE_M = 0.01
"""Held up this far above an object's top, the tool stands on something that covers it."""
WALL_MARGIN_M = 0.02
LIT = 0.5

Achieved = Callable[[Percept], bool]


class GoalJudge:
    """Tells which goals hold and whether the tool is where a goal should come about. Keeps no memory."""

    def __init__(self, scenario: Scenario, spec: StationSpec) -> None:
        self._goals = scenario.goals
        self._buttons = {b.name: i for i, b in enumerate(scenario.buttons)}
        self._boxes = {b.name: b for b in scenario.boxes}
        self._tops_m = {c.name: c.height_m / 2 for c in scenario.cylinders}
        self._reach_m = scenario.evaluation.reach_radius_m
        self._reached_below_m = spec.table_height_m + spec.heights_m[0] + scenario.evaluation.reach_height_m
        self._loose = tuple(c.name for c in scenario.cylinders)
        self._n_distances = spec.n_distances
        self._index: dict[str, int] = {}
        tests: dict[GoalKind, Callable[[Goal, Percept], bool]] = {
            GoalKind.PRESSED: self._is_pressed,
            GoalKind.GRABBED: self._is_grabbed,
            GoalKind.IN_BOX: self._is_in_box,
        }
        self._tests = tuple((tests[goal.kind], goal) for goal in self._goals)
        self._all_goals, self._all_tests = self._goals, self._tests

    @property
    def n_goals(self) -> int:
        """How many goals are known."""
        return len(self._goals)

    def grow(self, n_goals: int) -> None:
        """Judge so many goals, the scenario's first ones, and know of no other."""
        self._goals, self._tests = self._all_goals[:n_goals], self._all_tests[:n_goals]

    def achieved(self, percept: Percept) -> GoalState:
        """Return which goals hold now."""
        return tuple([test(goal, percept) for test, goal in self._tests])

    def known(self, percept: Percept, *, since_ns: int | None = None) -> GoalState:
        """Return of which goals it is known whether they hold.

        Args:
            percept: what is perceived now.
            since_ns: what was seen before, by the percept's clock, does not count; None lets all count that is valid.
        """
        return tuple([self._is_known(goal, percept, since_ns) for goal in self._goals])

    def is_at_place(self, goal: int, percept: Percept) -> bool:
        """Whether the tool is where a goal should come about, with a hand that is free for it.

        Said of a goal that does not hold, this is the "reached but blocked" bit: held up above the thing, or down at a
        place where nothing happened. A hand that moves, or holds something else, is not free: it proves nothing.
        """
        wanted = self._goals[goal]
        if percept.grip.is_moving or not self.is_hand_free(goal, percept):
            return False
        if wanted.kind is GoalKind.IN_BOX:
            return self._is_at_box(wanted, percept)
        thing = self._find(wanted.object, percept)
        if not thing.is_valid or not percept.is_in_contact:
            return False
        tool = percept.tcp_position_m
        is_near = math.dist(tool[:2], thing.position_m[:2]) <= self._reach_m
        if wanted.kind is GoalKind.PRESSED:
            return is_near
        is_held_up = tool[2] > thing.position_m[2] + self._tops_m[thing.name] + ABOVE_M
        return is_held_up and (is_near or self._shares_a_box(thing.position_m, tool, percept))

    def is_hand_free(self, goal: int, percept: Percept) -> bool:
        """Whether the hand holds nothing, or what the goal is about: with another thing in it no try is a fair one."""
        return self.held(percept) in (None, self._goals[goal].object)

    def held(self, percept: Percept) -> str | None:
        """Return the name of the object between the jaws of a hand that reports one."""
        if not percept.grip.has_object:
            return None
        tool = percept.tcp_position_m
        near = [(math.dist(tool, self._find(name, percept).position_m), name) for name in self._loose]
        distance, name = min(near, default=(math.inf, ""))
        return name if distance < IN_HAND_M else None

    def _is_known(self, goal: Goal, percept: Percept, since_ns: int | None) -> bool:
        if goal.kind is GoalKind.PRESSED:
            i = self._n_distances + self._buttons[goal.object]
            return percept.valid[i] and _is_since(percept, percept.ages_s[i], since_ns)
        if goal.kind is GoalKind.GRABBED and not percept.grip.has_object:
            return True  # a hand that feels nothing holds nothing
        thing = self._find(goal.object, percept)
        is_thing_known = thing.is_valid and _is_since(percept, thing.age_s, since_ns)
        return is_thing_known and (goal.box is None or self._find(goal.box, percept).is_valid)

    def _is_pressed(self, goal: Goal, percept: Percept) -> bool:
        i = self._buttons[goal.object]
        return percept.valid[self._n_distances + i] and percept.button_states[i] > LIT

    def _is_grabbed(self, goal: Goal, percept: Percept) -> bool:
        if not percept.grip.has_object:
            return False
        thing = self._find(goal.object, percept)
        return thing.is_valid and math.dist(thing.position_m, percept.tcp_position_m) < IN_HAND_M

    def _is_in_box(self, goal: Goal, percept: Percept) -> bool:
        assert goal.box is not None, "config checks that an in_box goal names its box"
        thing, place, box = self._find(goal.object, percept), self._find(goal.box, percept), self._boxes[goal.box]
        (x, y, z), (bx, by, bz) = thing.position_m, place.position_m
        is_inside = abs(x - bx) < box.inner_m[0] / 2 and abs(y - by) < box.inner_m[1] / 2 and z - bz < box.height_m
        return is_inside and thing.is_valid and place.is_valid and not self._is_grabbed(goal, percept)

    def _is_at_box(self, goal: Goal, percept: Percept) -> bool:
        """Over the box, but for a margin at its walls, held up or as low as the tool goes."""
        assert goal.box is not None, "config checks that an in_box goal names its box"
        place, box, tool = self._find(goal.box, percept), self._boxes[goal.box], percept.tcp_position_m
        (x, y, _), (bx, by, _), (side_x, side_y) = tool, place.position_m, box.inner_m
        is_over = abs(x - bx) < side_x / 2 - WALL_MARGIN_M and abs(y - by) < side_y / 2 - WALL_MARGIN_M
        return place.is_valid and is_over and (percept.is_in_contact or tool[2] < self._reached_below_m)

    def _shares_a_box(self, thing_m: Vec3, tool_m: Vec3, percept: Percept) -> bool:
        """Whether the tool is over the same box that a thing lies in: what covers the thing is not only above it."""
        for name, box in self._boxes.items():
            place = self._find(name, percept)
            (bx, by, _), (half_x, half_y) = place.position_m, (side / 2 for side in box.inner_m)
            if place.is_valid and all(abs(x - bx) < half_x and abs(y - by) < half_y for x, y, _ in (thing_m, tool_m)):
                return True
        return False

    def _find(self, name: str, percept: Percept) -> ObjectPercept:
        i = self._index.get(name, -1)
        if i < 0 or i >= len(percept.objects) or percept.objects[i].name != name:
            self._index = {thing.name: k for k, thing in enumerate(percept.objects)}
            i = self._index[name]
        return percept.objects[i]


def _is_since(percept: Percept, age_s: float, since_ns: int | None) -> bool:
    return since_ns is None or percept.stamp_ns - round(age_s * 1e9) >= since_ns
