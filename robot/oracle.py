"""What the rules in force let come about: the judge of learnt graphs, never shown to a learner. Pure."""

from collections.abc import Callable, Sequence

from config.reachable import GRIPPER_INPUT
from config.resolved import Resolved
from config.rules import Literal, RuleSet
from config.scenario import Goal, GoalKind, Scenario

__all__ = ["rules_oracle"]

GoalState = Sequence[bool]


def rules_oracle(resolved: Resolved) -> Callable[[int, GoalState, int], bool]:
    """Return whether a goal can come about in a goal-state in an epoch: (goal, state, epoch) -> allowed.

    A button can always be pressed. An object can be grabbed while the lid of the box it starts in is open. It can be
    put into a box while that box's lid is open and the object has been grabbed in this epoch. A goal-state says which
    goals were achieved in the epoch, of the first few where it is shorter; a latched input that none of those is about
    is taken to be as it was at the reset.
    """
    scenario = resolved.scenario
    judges = [_Judge(scenario, rules) for rules in resolved.rule_sets]
    starts = [span.from_epoch for span in scenario.schedule]

    def allowed(goal: int, state: GoalState, epoch: int) -> bool:
        in_force = sum(start <= epoch for start in starts) - 1
        return judges[in_force].allows(scenario.goals[goal], state)

    return allowed


class _Judge:
    """One rule set, read as needs of goals."""

    def __init__(self, scenario: Scenario, rules: RuleSet) -> None:
        lidded = {box.name for box in scenario.boxes if box.lid is not None}
        self._when = {rule.output: rule.when for rule in rules.rules if rule.output in lidded}
        self._starts_in = {cylinder.name: cylinder.inside for cylinder in scenario.cylinders}
        self._filled = set(self._starts_in.values())
        self._goals = scenario.goals

    def allows(self, goal: Goal, state: GoalState) -> bool:
        """Whether a goal can come about in a goal-state."""
        match goal.kind:
            case GoalKind.PRESSED:
                return True
            case GoalKind.GRABBED:
                return self._is_open(self._starts_in[goal.object], state)
            case GoalKind.IN_BOX:
                return self._is_open(goal.box, state) and self._was_grabbed(goal.object, state)

    def _was_grabbed(self, name: str, state: GoalState) -> bool:
        """Whether an object was in the hand in this epoch; where no goal tells, whether it could have been."""
        told = self._goals[: len(state)]
        grabs = [i for i, goal in enumerate(told) if goal.kind is GoalKind.GRABBED and goal.object == name]
        return any(state[i] for i in grabs) if grabs else self._is_open(self._starts_in[name], state)

    def _is_open(self, box: str | None, state: GoalState) -> bool:
        """Whether a box can be reached into; None is the open table."""
        if box is None or box not in self._when:
            return True
        return all(self._is_on(literal, state) == literal.is_on for literal in self._when[box])

    def _is_on(self, literal: Literal, state: GoalState) -> bool:
        """Whether a cell input is latched on, as far as the goal-state tells."""
        name = literal.input
        if name in self._filled:
            return True
        return any(is_on and _latches(goal, name) for goal, is_on in zip(self._goals, state, strict=False))


def _latches(goal: Goal, name: str) -> bool:
    """Whether achieving a goal turns a cell input on: a button, a box's sensor, or the hand's object-detected flag."""
    match goal.kind:
        case GoalKind.PRESSED:
            return goal.object == name
        case GoalKind.GRABBED:
            return name == GRIPPER_INPUT
        case GoalKind.IN_BOX:
            return goal.box == name
