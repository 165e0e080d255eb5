"""Which goals of a scenario can be reached under a rule set: a search over what an epoch can latch. Pure."""

from collections.abc import Iterator

import msgspec

from config.rules import RuleSet
from config.scenario import Cylinder, Goal, GoalKind, Scenario

__all__ = ["GRIPPER_INPUT", "MAX_STATES", "unreachable_goals"]

GRIPPER_INPUT = "gripper"
"""The cell's own input that is on once the hand has held something."""
MAX_STATES = 20_000
"""A search that grows beyond this is given up, and the goals not yet reached are taken to be reachable."""

TABLE = "table"
HAND = "hand"


class _Situation(msgspec.Struct, frozen=True, kw_only=True):
    """Latched inputs that are on, and where each cylinder is: in a box, on the table or in the hand."""

    latched: frozenset[str]
    places: tuple[str, ...]


def unreachable_goals(scenario: Scenario, rules: RuleSet) -> tuple[str, ...]:
    """Return the goals that no order of pressing, grabbing and placing can achieve within one epoch.

    Buttons can always be pressed; a box can be reached into while it has no lid or its rule's literals all hold; the
    hand closes and opens by its reflexes, holds one cylinder and lets it go on the table or in its receptacle. Inputs
    latch for the epoch.
    """
    world = _World(scenario, rules)
    missing = {goal.name for goal in scenario.goals}
    seen = {world.start()}
    stack = list(seen)
    while stack and missing:
        here = stack.pop()
        missing -= {goal.name for goal in scenario.goals if world.is_achieved(goal, here)}
        for after in world.moves(here):
            if after not in seen:
                seen.add(after)
                stack.append(after)
        if len(seen) > MAX_STATES:
            return ()
    return tuple(goal.name for goal in scenario.goals if goal.name in missing)


class _World:
    """The table as far as latches go: contacts and distances left out."""

    def __init__(self, scenario: Scenario, rules: RuleSet) -> None:
        self._cylinders = scenario.cylinders
        self._reflexes = scenario.reflexes
        self._buttons = {button.name for button in scenario.buttons}
        self._lidded = {box.name for box in scenario.boxes if box.lid is not None}
        self._sensors: frozenset[str] = frozenset(box.name for box in scenario.boxes if box.presence_input is not None)
        self._when = {rule.output: rule.when for rule in rules.rules}
        asked = {literal.input for rule in rules.rules for literal in rule.when}
        goals = {goal.object for goal in scenario.goals}
        self._worth_pressing = sorted(self._buttons & (asked | goals))

    def start(self) -> _Situation:
        places = tuple(cylinder.inside or TABLE for cylinder in self._cylinders)
        return _Situation(latched=self._sensors.intersection(places), places=places)

    def moves(self, here: _Situation) -> Iterator[_Situation]:
        """Yield what one act can lead to."""
        for button in self._worth_pressing:
            yield _Situation(latched=here.latched | {button}, places=here.places)
        if HAND not in here.places:
            if not self._reflexes.close_on_object:
                return
            for i, place in enumerate(here.places):
                if self._is_open(place, here):
                    yield self._moved(here, i, HAND, GRIPPER_INPUT)
            return
        held = here.places.index(HAND)
        for place in self._lets_go(self._cylinders[held]):
            if self._is_open(place, here):
                yield self._moved(here, held, place, place)

    def is_achieved(self, goal: Goal, here: _Situation) -> bool:
        """Return whether a goal has come about in this very situation."""
        if goal.kind is GoalKind.PRESSED:
            return goal.object in here.latched
        names = [cylinder.name for cylinder in self._cylinders]
        return here.places[names.index(goal.object)] == (HAND if goal.kind is GoalKind.GRABBED else goal.box)

    def _is_open(self, place: str, here: _Situation) -> bool:
        if place not in self._lidded:
            return True
        return all((literal.input in here.latched) == literal.is_on for literal in self._when[place])

    def _moved(self, here: _Situation, i: int, place: str, latches: str) -> _Situation:
        places = (*here.places[:i], place, *here.places[i + 1 :])
        is_input = latches in self._sensors or latches == GRIPPER_INPUT
        return _Situation(latched=here.latched | {latches} if is_input else here.latched, places=places)

    def _lets_go(self, cylinder: Cylinder) -> Iterator[str]:
        if cylinder.receptacle is not None and self._reflexes.open_over_receptacle:
            yield cylinder.receptacle
        if self._reflexes.open_on_table:
            yield TABLE
