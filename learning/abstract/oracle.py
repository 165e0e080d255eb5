"""The oracle: upper layers that know how the table draws its rules, and keep all that can be known of those in force.

It is told what no learner is: the class of rules and how probable each is, the hazard of change, and how the table
judges trials. It never sees the rules. While anything is worth finding out, goals and sub-goals are chosen by expected
information; when nothing is, goals are drawn evenly and pursued by expected success. That is exact in what is believed
(learning/abstract/oracle_belief.py), but for accidents that did not happen, which tell it nothing; and greedy in what
is tried: what a failure would open is not planned for. Things that fill the hand it knows nothing of.
"""

from collections.abc import Iterable
from typing import Any

import msgspec
import numpy as np

from learning.abstract.oracle_belief import RuleBelief
from learning.abstract.oracle_value import after, information, worth_of_information, worth_of_success
from learning.abstract.rules import TRIALS, bits, chance_of_needs
from learning.abstract.table import Skills
from learning.interfaces import Attempt, GoalState, TrialOutcome

__all__ = ["Oracle", "OracleGoals", "OracleSubgoals", "Told", "outcome_chances"]

PRICE = 0.05
"""Nats that a trial must tell to be worth it for that alone."""
OUTCOMES = (TrialOutcome.ACHIEVED, TrialOutcome.BLOCKED, TrialOutcome.NOT_REACHED)


class Told(msgspec.Struct, frozen=True, kw_only=True):
    """What the oracle is told of the table."""

    n_goals: int
    max_literals: int
    """Of the rules, as they are drawn."""
    hazard: float
    """Chance an epoch that they are drawn anew."""
    skills: Skills


def outcome_chances(skill: float, skills: Skills) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the chance of each of `OUTCOMES` where the goal is allowed, and where it is not."""
    lacking, unseen = 1.0 - skill, skills.unseen_block
    if_allowed = skill, lacking * skills.wrongly_blocked, lacking * (1.0 - skills.wrongly_blocked)
    return if_allowed, (0.0, skill * (1.0 - unseen), skill * unseen + lacking)


class Oracle:
    """What is known, and what each trial is worth by that. Shared by the two layers."""

    def __init__(self, told: Told) -> None:
        self.n_goals = told.n_goals
        prior = [chance_of_needs(told.n_goals, goal, told.max_literals) for goal in range(told.n_goals)]
        self.belief = RuleBelief(prior, hazard=told.hazard)
        self._skills = told.skills
        self._n_achieved = [0] * told.n_goals
        self._following = after(told.n_goals)  # (n, 2^n)
        states = np.arange(1 << told.n_goals)
        self._allows = [self.belief.allows(goal, states).astype(np.float32) for goal in range(told.n_goals)]
        """By goal: which conjunctions allow it in which goal-states, (h, 2^n)."""
        self.n_epochs = 0
        self.n_left = TRIALS
        """Trials of the epoch in hand."""
        self._allowed: np.ndarray | None = None
        self._ways: dict[int, np.ndarray] = {}

    def begin_epoch(self) -> None:
        """Count with a change of rules since the last one."""
        if self.n_epochs:
            self.belief.begin_epoch()
            self._forget_values()
        self.n_epochs += 1
        self.n_left = TRIALS

    def learn(self, attempt: Attempt) -> None:
        """Take in what came of a trial, and what came about by accident."""
        if attempt.outcome is TrialOutcome.VOID:
            return
        goal, state = attempt.subgoal, bits(attempt.state)
        is_achieved = attempt.outcome is TrialOutcome.ACHIEVED
        told = zip(*self._channel(goal), strict=True)
        if_allowed, if_not = dict(zip(OUTCOMES, told, strict=True))[attempt.outcome]
        self.belief.update(goal, state, if_allowed=if_allowed, if_not=if_not)
        self._n_achieved[goal] += is_achieved
        before = state | is_achieved << goal
        for i in range(self.n_goals):
            if attempt.state_after[i] and not before >> i & 1:
                self.belief.update(i, before, if_allowed=1.0, if_not=0.0)
        self.n_left -= 1
        self._forget_values()

    def allowed(self) -> np.ndarray:
        """Return how probable it is that each goal is allowed in each goal-state.  () -> (n, 2^n)"""
        if self._allowed is None:
            marginals = self.belief.marginals().astype(np.float32)
            told = [chances @ allows for chances, allows in zip(marginals, self._allows, strict=True)]
            self._allowed = np.clip(np.array(told, dtype=float), 0.0, 1.0)
        return self._allowed

    def search(self, state: int, *, goal: int | None) -> int | None:
        """Return the trial that is worth most for what it tells, None where none is worth its price."""
        worth = self._worth_of_information(goal)[:, state]
        best = int(np.argmax(worth))
        return best if worth[best] > 0.0 else None

    def pursue(self, goal: int, state: int) -> int:
        """Return the trial that makes it surest that a goal is achieved."""
        if goal not in self._ways:
            worth = worth_of_success(self._achieved(), self._following, goal=goal, n_trials=TRIALS)
            self._ways[goal] = worth.argmax(axis=0)
        return int(self._ways[goal][state])

    def last_of_search(self) -> int | None:
        """Return the goal that the most telling trials of an epoch end with, None where none is worth its price."""
        worth, state, last = self._worth_of_information(None), 0, None
        for _ in range(self.n_left):
            best = int(np.argmax(worth[:, state]))
            if worth[best, state] <= 0.0:
                break
            state, last = state | 1 << best, best
        return last

    def _worth_of_information(self, goal: int | None) -> np.ndarray:
        channels = np.array([self._channel(g) for g in range(self.n_goals)])  # (n, 2, o)
        told = information(self.allowed(), channels[:, 0], channels[:, 1])
        return worth_of_information(
            told, self._achieved(), self._following, price=PRICE, goal=goal, n_trials=max(1, self.n_left)
        )

    def _achieved(self) -> np.ndarray:
        """Return the chance of success of each trial in each goal-state.  () -> (n, 2^n)"""
        return self.allowed() * np.array([self._skills.at(n) for n in self._n_achieved])[:, None]

    def _channel(self, goal: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return outcome_chances(self._skills.at(self._n_achieved[goal]), self._skills)

    def _forget_values(self) -> None:
        self._allowed, self._ways = None, {}

    def state_dict(self) -> dict[str, Any]:
        """Return all that is known."""
        return {"belief": self.belief.state_dict(), "n_achieved": list(self._n_achieved), "n_epochs": self.n_epochs}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.belief.load_state_dict(state["belief"])
        self._n_achieved, self.n_epochs = list(state["n_achieved"]), state["n_epochs"]
        self._forget_values()


class OracleGoals:
    """Chooses the goal of an epoch (learning.agent.GoalSelector)."""

    def __init__(self, oracle: Oracle, *, rng: np.random.Generator) -> None:
        self._oracle, self._rng = oracle, rng

    def select(self) -> int:
        """Return the goal that what is worth finding out ends with, else one drawn evenly."""
        self._oracle.begin_epoch()
        last = self._oracle.last_of_search()
        return int(self._rng.integers(self._oracle.n_goals)) if last is None else last

    def temperature(self, goal: int) -> float:
        """Return none: nothing is drawn by it."""
        del goal
        return 0.0

    def update(self, attempt: Attempt) -> None:
        """Learn nothing: the other layer does."""

    def end_epoch(self, goal: int, *, predicted: float, is_achieved: bool) -> None:
        """Learn nothing: trials told it all."""

    def rearm(self, goals: Iterable[int]) -> None:
        """Nothing is worn out."""

    def state_dict(self) -> dict[str, Any]:
        """Return the generator's state."""
        return {"rng": self._rng.bit_generator.state}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._rng.bit_generator.state = state["rng"]


class OracleSubgoals:
    """Chooses the sub-goal of a trial, and learns (learning.interfaces.SubgoalSelector)."""

    def __init__(self, oracle: Oracle) -> None:
        self.oracle = oracle

    def select(
        self, *, goal: int, state: GoalState, available: tuple[bool, ...], temperature: float, explore: bool
    ) -> int:
        """Return the trial that tells most while that is worth its price, else the one that serves the goal best."""
        del temperature
        if not any(available):
            raise ValueError("expected at least one available sub-goal, got none")
        here = bits(state)
        telling = self.oracle.search(here, goal=goal) if explore else None
        step = self.oracle.pursue(goal, here) if telling is None else telling
        return step if available[step] else available.index(True)

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial. Void attempts change nothing."""
        self.oracle.learn(attempt)

    def changed_goals(self) -> tuple[int, ...]:
        """Return nothing: the goal of the next epoch is chosen by what is known then."""
        return ()

    def state_dict(self) -> dict[str, Any]:
        """Return all that is known."""
        return self.oracle.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.oracle.load_state_dict(state)
