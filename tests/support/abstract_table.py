"""A table without physics: goal-states, needs, chances of success. The upper layers learn on it in seconds.

It runs the upper layers as the agent does and measures them by the project's words: mastered, learnt, recovered, right.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np

from config.learning import GoalSelection, SubgoalSelection
from learning.goal_selector import GoalSelector
from learning.interfaces import Attempt, GoalState, SubgoalSelector, TrialOutcome
from learning.planning import Effort, cheapest_plan
from learning.preconditions import START, Needs, Situation
from learning.subgoal_graph import GraphSelector
from learning.subgoal_selector import make_subgoal_selector

__all__ = [
    "PAPER_AFTER",
    "PAPER_BEFORE",
    "REPORTING_SEEDS",
    "TUNING_SEEDS",
    "AbstractTable",
    "Learner",
    "Result",
    "Rules",
    "Skills",
    "draw_rules",
    "is_graph_right",
    "needs",
    "optimal_trials",
    "reachable_states",
    "run_experiment",
]

TUNING_SEEDS = tuple(range(100, 116))
"""Seeds on which settings were chosen."""
REPORTING_SEEDS = tuple(range(10))
"""Seeds on which the figures in reports were measured, and that tests run on."""

Rules = tuple[Needs, ...]
TRIALS = 8
WINDOW = 20


def needs(on: Sequence[int] = (), off: Sequence[int] = ()) -> Needs:
    """Return a conjunction from goal indices."""
    return Needs(sum(1 << i for i in on), sum(1 << i for i in off))


PAPER_BEFORE: Rules = (needs(), needs(), needs(), needs([1]), needs([2]), needs([4]))
PAPER_AFTER: Rules = (needs(), needs(), needs(), needs(off=[1]), needs(off=[2]), needs([4, 0]))


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


class AbstractTable:
    """One table: rules in force, goals achieved and goals that hold."""

    def __init__(
        self, *, n_goals: int, skills: Skills, rng: np.random.Generator,
        grabs: frozenset[int] = frozenset({3, 4}), carried: dict[int, int] | None = None,
    ) -> None:  # fmt: skip
        self.n_goals = n_goals
        self._skills = skills
        self._rng = rng
        self._grabs = grabs
        self._carried = {5: 4} if carried is None else carried
        """Goal -> goal that must hold still when it is achieved (a thing in the hand)."""
        self._n_achieved = [0] * n_goals
        self.rules: Rules = (needs(),) * n_goals
        self.latched = self.holds = (False,) * n_goals

    def reset(self) -> None:
        """Lay the table out anew."""
        self.latched = self.holds = (False,) * self.n_goals

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
        rest = np.exp(-self._n_achieved[goal] / self._skills.practice)
        return float(self._skills.last - (self._skills.last - self._skills.first) * rest)

    def _judge(self, p_blocked: float) -> TrialOutcome:
        return TrialOutcome.BLOCKED if self._rng.random() < p_blocked else TrialOutcome.NOT_REACHED

    def _allows(self, goal: int) -> bool:
        """Whether the needs are met; what must be carried must be held now."""
        thing = self._carried.get(goal)
        return self.rules[goal].allow(_situation(bits(self.latched))) and (thing is None or self.holds[thing])

    def _achieve(self, goal: int) -> None:
        if goal in self._grabs or goal in self._carried:
            self._let_go()
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


class Learner:
    """The upper layers as the agent runs them."""

    def __init__(
        self, *, n_goals: int, goals: GoalSelection, subgoals: SubgoalSelection, rng: np.random.Generator
    ) -> None:
        first, second = rng.spawn(2)
        self.n_goals = n_goals
        self.goal_selector = GoalSelector(n_goals=n_goals, config=goals, subgoals=subgoals, rng=first)
        self.selector: SubgoalSelector = make_subgoal_selector(n_goals=n_goals, config=subgoals, rng=second)
        self._outcomes: list[list[bool]] = [[] for _ in range(n_goals)]

    def learn_epoch(self, table: AbstractTable, epoch: int) -> tuple[int, bool, int]:
        """Run one epoch of learning; return its goal, whether it was achieved, and the trials it took."""
        goal = self.goal_selector.select()
        predicted = self._skill(goal)
        is_achieved, n_trials = self._pursue(table, epoch, goal, explore=True)
        self.goal_selector.end_epoch(goal, predicted=predicted, is_achieved=is_achieved)
        return goal, is_achieved, n_trials

    def test_epoch(self, table: AbstractTable, epoch: int, goal: int) -> tuple[bool, int]:
        """Pursue a goal with learning off; return whether it was achieved, and the trials it took."""
        return self._pursue(table, epoch, goal, explore=False)

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt."""
        return {
            "goal_selector": self.goal_selector.state_dict(),
            "selector": self.selector.state_dict(),
            "outcomes": [list(results) for results in self._outcomes],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.goal_selector.load_state_dict(state["goal_selector"])
        self.selector.load_state_dict(state["selector"])
        self._outcomes = [list(results) for results in state["outcomes"]]

    def _pursue(self, table: AbstractTable, epoch: int, goal: int, *, explore: bool) -> tuple[bool, int]:
        table.reset()
        n_trials = 0
        while n_trials < TRIALS and not table.latched[goal]:
            n_trials += 1
            attempt = self._trial(table, epoch, goal, explore=explore)
            if explore:
                self._learn(attempt)
        return table.latched[goal], n_trials

    def _trial(self, table: AbstractTable, epoch: int, goal: int, *, explore: bool) -> Attempt:
        state, holds = table.latched, table.holds
        subgoal = self.selector.select(
            goal=goal, state=state, available=tuple(not h for h in holds),
            temperature=self.goal_selector.temperature(goal), explore=explore,
        )  # fmt: skip
        skill = self._skill(subgoal)
        outcome = table.attempt(subgoal, practise=explore)
        return Attempt(
            epoch=epoch, goal=goal, subgoal=subgoal, state=state, state_after=table.latched, holds=holds,
            holds_after=table.holds, outcome=outcome, predicted=skill, skill=skill, n_steps=1,
        )  # fmt: skip

    def _learn(self, attempt: Attempt) -> None:
        if attempt.outcome is not TrialOutcome.BLOCKED:
            self._outcomes[attempt.subgoal].append(attempt.outcome is TrialOutcome.ACHIEVED)
        self.goal_selector.update(attempt)
        self.selector.update(attempt)
        self.goal_selector.rearm(self.selector.changed_goals())

    def _skill(self, goal: int) -> float:
        newest = self._outcomes[goal][-WINDOW:]
        return (sum(newest) + 1) / (len(newest) + 2)


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """What one experiment came to; epochs are counted from the start, or from the switch."""

    learnt: int | None
    recovered: int | None
    right_before: int | None
    """Epoch from which the graph was right and stayed so until the switch, as far as it was looked at."""
    right_after: int | None
    over_optimum: tuple[float, float]
    """Trials over the optimum, mean over goals of the mean over their learning epochs, last 200 of each half."""
    success: tuple[float, float]
    """Share of learning epochs achieved, last 200 epochs of each half."""
    goals: tuple[int, ...]
    """Goal of each epoch."""


def run_experiment(
    *, seed: int, goals: GoalSelection, subgoals: SubgoalSelection, before: Rules = PAPER_BEFORE,
    after: Rules = PAPER_AFTER, epochs: int = 1000, skills: Skills | None = None, **table_kwargs: object,
) -> Result:  # fmt: skip
    """Learn for so many epochs under each rule set and measure as judged runs are."""
    rng = np.random.default_rng(seed)
    first, second = rng.spawn(2)
    n_goals = len(before)
    table = AbstractTable(n_goals=n_goals, skills=skills or Skills(), rng=first, **table_kwargs)  # type: ignore[arg-type]
    learner = Learner(n_goals=n_goals, goals=goals, subgoals=subgoals, rng=second)
    halves = [_run_half(table, learner, rules, first_epoch=i * epochs, epochs=epochs)
              for i, rules in enumerate((before, after))]  # fmt: skip
    return Result(
        learnt=halves[0].mastered, recovered=halves[1].mastered,
        right_before=halves[0].right, right_after=halves[1].right,
        over_optimum=(halves[0].over_optimum, halves[1].over_optimum), success=(halves[0].success, halves[1].success),
        goals=halves[0].goals + halves[1].goals,
    )  # fmt: skip


class _Half(msgspec.Struct, frozen=True, kw_only=True):
    mastered: int | None
    right: int | None
    over_optimum: float
    success: float
    goals: tuple[int, ...]


def _run_half(table: AbstractTable, learner: Learner, rules: Rules, *, first_epoch: int, epochs: int) -> _Half:
    table.rules = rules
    rows: list[tuple[int, bool, int]] = []
    is_mastered_at: list[tuple[int, bool]] = []
    wrong_until, was_looked_at = 0, isinstance(learner.selector, GraphSelector)
    for i in range(1, epochs + 1):
        rows.append(learner.learn_epoch(table, first_epoch + i))
        if i % (10 if i <= 150 else 50) == 0 and sum(a and b for a, b in _pairs(is_mastered_at)) == 0:
            is_mastered_at.append((i, _all_mastered(table, learner, first_epoch + i)))
        if was_looked_at and i % 10 == 0 and not is_graph_right(learner.selector, rules):
            wrong_until = i
    firsts = [a for (a, ok), (_, also) in pairwise(is_mastered_at) if ok and also]
    last = rows[-200:]
    optimum = optimal_trials(rules)
    over = [np.mean([n - optimum[g] for g, _, n in last if g == goal] or [0.0]) for goal in range(learner.n_goals)]
    return _Half(
        mastered=firsts[0] if firsts else None,
        right=wrong_until + 10 if was_looked_at and wrong_until < epochs else None,
        over_optimum=float(np.mean(over)), success=float(np.mean([ok for _, ok, _ in last])),
        goals=tuple(g for g, _, _ in rows),
    )  # fmt: skip


def _pairs(evaluations: list[tuple[int, bool]]) -> list[tuple[bool, bool]]:
    return [(a, b) for (_, a), (_, b) in pairwise(evaluations)]


def _all_mastered(table: AbstractTable, learner: Learner, epoch: int) -> bool:
    for goal in range(learner.n_goals):
        if sum(learner.test_epoch(table, epoch, goal)[0] for _ in range(20)) < 18:
            return False
    return True


def is_graph_right(selector: SubgoalSelector, rules: Rules) -> bool:
    """Whether the graph says the same as the rules of every goal in every goal-state that can be reached."""
    assert isinstance(selector, GraphSelector)
    return all(
        (selector.graph.beliefs[g].predict_allowed(_situation(state)) > 0.5) == rules[g].allow(_situation(state))
        for state in reachable_states(rules)
        for g in range(len(rules))
    )


def reachable_states(rules: Rules) -> set[int]:
    """Return every goal-state that can come about from the empty one."""
    found, frontier = {0}, [0]
    while frontier:
        state = frontier.pop()
        for g, needed in enumerate(rules):
            there = state | 1 << g
            if needed.allow(_situation(state)) and there not in found:
                found.add(there)
                frontier.append(there)
    return found


def optimal_trials(rules: Rules) -> tuple[int, ...]:
    """Return the fewest trials that each goal takes from the empty goal-state."""
    plans = [cheapest_plan(g, START, rules.__getitem__, _effort(len(rules))) for g in range(len(rules))]
    return tuple(len(plan) if plan else TRIALS for plan in plans)


def draw_rules(rng: np.random.Generator, n_goals: int, *, max_literals: int = 3) -> Rules:
    """Draw needs of up to so many literals, on and off, such that every goal can be achieved within the trials."""
    while True:
        rules = tuple(_draw_needs(rng, g, n_goals, max_literals) for g in range(n_goals))
        plans = [cheapest_plan(g, START, rules.__getitem__, _effort(n_goals)) for g in range(n_goals)]
        if all(plan and len(plan) <= TRIALS - 3 for plan in plans):
            return rules


def _effort(n_goals: int) -> Effort:
    return Effort(trials=[1.0] * n_goals, losses=[[0.0] * n_goals] * n_goals)


def _draw_needs(rng: np.random.Generator, goal: int, n_goals: int, max_literals: int) -> Needs:
    others = [i for i in range(n_goals) if i != goal]
    members = rng.choice(others, size=int(rng.integers(0, max_literals + 1)), replace=False)
    is_on = rng.random(len(members)) < 0.6
    return needs([int(i) for i in members[is_on]], [int(i) for i in members[~is_on]])


def _situation(state: int) -> Situation:
    return Situation(state, state)


def bits(state: GoalState) -> int:
    """Return a goal-state as a bit mask."""
    return sum(1 << i for i, is_on in enumerate(state) if is_on)


def _with(state: GoalState, goal: int, *, is_on: bool) -> GoalState:
    return (*state[:goal], is_on, *state[goal + 1 :])
