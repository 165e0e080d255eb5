"""A table without physics: rules in force, and experts that are chances of success."""

from collections.abc import Sequence

import msgspec
import numpy as np

from learning.abstract.rules import Rule, needs, permits
from learning.interfaces import GoalState, TrialOutcome

__all__ = ["AbstractTable", "Skills", "Things"]


class Skills(msgspec.Struct, frozen=True, kw_only=True):
    """How the experts fare and how trials are judged."""

    first: float = 0.95
    """Chance of success of an unpractised expert where nothing blocks."""
    last: float = 0.95
    """The same after long practice."""
    practice: float = 5.0
    """Successes after which about two thirds of the way are done."""
    wrongly_blocked: float = 0.05
    """Share of the failures for lack of skill that count as blocked."""
    unseen_block: float = 0.1
    """Share of trials at a blocked goal that count as not reached, on top of what the skill makes so."""
    accident: float = 0.01
    """Chance per trial that a free button is pressed on the way."""
    drop: float = 0.0
    """Chance per trial that what the hand holds is dropped."""

    def at(self, n_achieved: int) -> float:
        """Return the chance of success where nothing blocks, after so many practised successes."""
        return float(self.last - (self.last - self.first) * np.exp(-n_achieved / self.practice))


class Things(msgspec.Struct, frozen=True, kw_only=True):
    """What the hand has to do with goals: none of them where left out."""

    grabs: frozenset[int] = frozenset()
    """Goals that fill the hand; achieving another of them empties it."""
    carried: tuple[tuple[int, int], ...] = ()
    """Goals that need what another has put into the hand to be there still."""


class AbstractTable:
    """One table: rules in force, goals achieved and goals that hold."""

    def __init__(self, *, n_goals: int, skills: Skills, rng: np.random.Generator, things: Things | None = None) -> None:
        self.n_goals = n_goals
        self._skills, self._rng = skills, rng
        things = things or Things()
        self._grabs, self._carried = things.grabs, dict(things.carried)
        self._n_achieved = [0] * n_goals
        self.rules: Sequence[Rule] = (needs(),) * n_goals
        self.latched = self.holds = (False,) * n_goals
        self._order: tuple[int, ...] = ()
        """Goals in the order in which they came about."""

    def reset(self) -> None:
        """Lay the table out anew."""
        self.latched = self.holds = (False,) * self.n_goals
        self._order = ()

    def attempt(self, goal: int, *, practise: bool) -> TrialOutcome:
        """Let the expert of a goal try, and return how the trial is judged."""
        if self._rng.random() < self._skills.drop:
            self._let_go()
        is_skilled = self._rng.random() < self.skill(goal)
        thing = self._carried.get(goal)
        if thing is not None and not self.holds[thing]:
            outcome = TrialOutcome.NOT_REACHED
        elif is_skilled and self._allows(goal):
            self._achieve(goal)
            self._n_achieved[goal] += practise
            outcome = TrialOutcome.ACHIEVED
        elif self._allows(goal):
            outcome = self._judge(self._skills.wrongly_blocked)
        else:
            outcome = self._judge(1.0 - self._skills.unseen_block) if is_skilled else TrialOutcome.NOT_REACHED
        if practise and self._rng.random() < self._skills.accident:
            self._stumble()
        return outcome

    def skill(self, goal: int) -> float:
        """Return the chance of success where nothing blocks."""
        return self._skills.at(self._n_achieved[goal])

    def _judge(self, p_blocked: float) -> TrialOutcome:
        return TrialOutcome.BLOCKED if self._rng.random() < p_blocked else TrialOutcome.NOT_REACHED

    def _allows(self, goal: int) -> bool:
        """Whether the needs are met; what must be carried must be held now."""
        thing = self._carried.get(goal)
        return permits(self.rules[goal], self._order) and (thing is None or self.holds[thing])

    def _achieve(self, goal: int) -> None:
        if goal in self._grabs or goal in self._carried:
            self._let_go()
        if not self.latched[goal]:
            self._order = (*self._order, goal)
        self.latched = _with(self.latched, goal, is_on=True)
        self.holds = _with(self.holds, goal, is_on=True)

    def _let_go(self) -> None:
        for i in self._grabs:
            self.holds = _with(self.holds, i, is_on=False)

    def _stumble(self) -> None:
        free = [i for i in range(self.n_goals) if i not in self._grabs and i not in self._carried]
        i = int(self._rng.choice(free))
        if self._allows(i):
            self._achieve(i)


def _with(state: GoalState, goal: int, *, is_on: bool) -> GoalState:
    return (*state[:goal], is_on, *state[goal + 1 :])
