"""Words and doors inside the learning room."""

from enum import StrEnum
from typing import Any, NamedTuple, Protocol, runtime_checkable

import msgspec

from robot.messages import Heading, Percept, StepResult

__all__ = ["Attempt", "Experts", "GoalState", "Grows", "Kept", "Late", "SubgoalSelector", "TrialOutcome"]

GoalState = tuple[bool, ...]
"""Which goals were achieved during the current epoch (latched), by goal index."""


class TrialOutcome(StrEnum):
    """How a trial at a sub-goal ended."""

    ACHIEVED = "achieved"
    BLOCKED = "blocked"
    """The tool was at the sub-goal's place, hand free for it, and the goal did not come about.

    That is evidence of a missing precondition.
    """
    NOT_REACHED = "not_reached"
    """The tool never came to the place: evidence about the skill only."""
    VOID = "void"
    """Cut short by a stop, a fault or a person: evidence about nothing."""


class Attempt(msgspec.Struct, frozen=True, kw_only=True):
    """One trial, as the upper layers see it."""

    epoch: int
    goal: int
    """Main goal of the epoch."""
    subgoal: int
    state: GoalState
    """Goals latched before the trial."""
    state_after: GoalState
    """Goals latched after the trial; may hold goals reached by accident."""
    holds: GoalState | None = None
    """Goals that hold at the trial's start, not latched: a thing dropped is held no longer. None where not judged."""
    holds_after: GoalState | None = None
    """Goals that hold at the trial's end, not latched."""
    outcome: TrialOutcome
    predicted: float
    """Expected probability of achieving the sub-goal, said at the trial's start, in [0, 1]."""
    skill: float
    """The expert's own measured chance of success where nothing blocks it, in [0, 1]."""
    n_steps: int
    is_explored: bool = False
    """Curiosity moved the arm when the trial ended, and not the sub-goal's model."""


class Kept(Protocol):
    """What a checkpoint holds. State_dicts hold None, bool, int, float, str, list, dict and numpy arrays only."""

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generators' states."""
        ...

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        ...


@runtime_checkable
class Grows(Protocol):
    """What takes in goals that become known while it learns, and keeps all that it knows of the others."""

    def grow(self, n_goals: int) -> None:
        """Know so many goals, the first ones of which are those that it knew."""
        ...


class SubgoalSelector(Kept, Protocol):
    """Chooses the sub-goal of each trial."""

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return a sub-goal index among the available ones.

        Without explore: the best, no randomness, nothing changed.
        """
        ...

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. Void attempts change nothing."""
        ...

    def changed_goals(self) -> tuple[int, ...]:
        """Return the goals for which what they are believed to need was revised by the last update."""
        ...


class Late(NamedTuple):
    """What turned out, on looking again after a trial, to have come about in it."""

    percept: Percept
    """That the trial's last step ended with."""
    achieved: GoalState


class Experts(Kept, Protocol):
    """All experts of a learner, one utility model a goal.

    Sees P(t), the shaped target, intents and whether the fingers are moving; goals are indices.
    """

    @property
    def is_exploring(self) -> bool:
        """Whether curiosity, and not the sub-goal's model, chose the newest intent."""
        ...

    def begin_trial(self, subgoal: int, percept: Percept, *, explore: bool) -> None:
        """Start a trial. With explore=False: greedy, draws nothing, changes nothing learnt."""
        ...

    def act(self, percept: Percept) -> Heading:
        """Return the next intent."""
        ...

    def observe(self, result: StepResult, achieved: GoalState) -> None:
        """Take in what the step came to; achieved tells every goal that came about in this very step."""
        ...

    def end_trial(self, outcome: TrialOutcome, *, is_fair: bool = True, late: Late | None = None) -> None:
        """Close the trial and, when learning, train. A miss that was no fair try says nothing against the skill."""
        ...

    def utility(self, subgoal: int, percept: Percept) -> float:
        """Return the expected probability of achieving the sub-goal from here, in [0, 1]."""
        ...

    def skill(self, subgoal: int) -> float:
        """Return the measured chance of success where nothing blocks, in [0, 1]."""
        ...
