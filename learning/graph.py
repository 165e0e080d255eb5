"""The learnt graph: what each goal is believed to need, how sure that is, and the plans that follow from it."""

from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from config.learning import SubgoalSelection
from learning.interfaces import Attempt, TrialOutcome
from learning.planning import Effort, cheapest_plan, relevant_goals
from learning.preconditions import START, Belief, Evidence, Likelihood, Needs, Situation, mask

__all__ = ["Finding", "Graph"]

LEAST_SKILL = 0.05
KNOWN = 0.5
"""Least chance of being allowed at a plan's end for it to count as a known way."""
BEGINNERS_LUCK = 0.15
"""Chance that an expert without one success achieves its goal in a trial where it is allowed."""
GOOD = 0.5
"""Skill that an expert must have had for its missing the place to say something of what the goal needs."""
LASTING, LOST = 50, -1
"""Trials that a goal must have been seen to hold through before it counts as one that does not come and go."""
LOSS = 0.02
"""Chance that achieving a goal loses another, before it was ever seen."""
FORGET = 0.98
"""How much of an expert's best skill is still believed after each later attempt."""
N_EVIDENCE = 200
"""Attempts remembered per goal, to be told to a person; nothing is learnt from them twice."""
N_CARRIED = 20.0
"""Trials over which it is remembered how often achieving a goal lost another."""


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """What one piece of evidence came to."""

    goal: int
    situation: Situation
    """Before the trial."""
    expected: float
    """Chance that had been given to the result that came."""
    is_revised: bool
    """The goal's most probable needs changed."""


class Graph:
    """A belief per goal, and what planning must know besides: skills, and which goals get lost again."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection) -> None:
        self.n_goals = n_goals
        self._config = config
        self.beliefs = tuple(
            Belief(n_goals=n_goals, goal=g, max_literals=config.max_literals, literal_cost=config.literal_cost)
            for g in range(n_goals)
        )
        self._skill = [1.0] * n_goals
        self._came_about = [False] * n_goals
        """Goals that were achieved at least once."""
        self._best_skill = [0.0] * n_goals
        """Of its better days: tried where nothing is to be had, an expert looks unskilled."""
        self._n_lasted = [0] * n_goals
        """Trials through which a goal held; LOST once it was lost: a thing taken can be let go again."""
        self._carried = np.zeros((n_goals, n_goals))
        self._lost = np.zeros((n_goals, n_goals))
        """[j, k]: how often goal k held when goal j was achieved, and then held no longer."""
        self._changed_epoch: list[int | None] = [None] * n_goals
        self._log = tuple(deque[Evidence](maxlen=N_EVIDENCE) for _ in range(n_goals))

    # ------------------------------------------------------------------------------------------------------ learn

    def learn(self, attempt: Attempt) -> tuple[Finding, ...]:
        """Learn from one trial: from what was tried, and from what came about by accident."""
        tried, outcome = attempt.subgoal, attempt.outcome
        if outcome is TrialOutcome.VOID:
            return ()
        self._skill[tried] = attempt.skill
        self._best_skill[tried] = max(attempt.skill, FORGET * self._best_skill[tried])
        self._note_fleeting(attempt)
        findings: list[Finding] = []
        if outcome is TrialOutcome.ACHIEVED:
            self._count_losses(attempt)
            findings.append(self._update(tried, attempt, is_achieved=True))
        elif outcome is TrialOutcome.BLOCKED or not self._config.use_blocked_only:
            findings.append(self._update(tried, attempt, is_achieved=False))
        elif not self._came_about[tried]:
            self._doubt(tried, attempt)
        elif self._config.miss_weight and self._best_skill[tried] >= GOOD and not self._has_hands_full(attempt):
            findings.append(self._miss(tried, attempt))
        for i, (was_on, is_on) in enumerate(zip(attempt.state, attempt.state_after, strict=True)):
            if is_on and not was_on and i != tried:
                findings.append(self._update(i, attempt, is_achieved=True))
        return tuple(findings)

    def _update(self, goal: int, attempt: Attempt, *, is_achieved: bool) -> Finding:
        belief, before = self.beliefs[goal], self.most_probable(goal)
        self._came_about[goal] |= is_achieved
        evidence = Evidence(
            epoch=attempt.epoch, is_achieved=is_achieved, readings=_readings(goal, attempt, is_achieved=is_achieved)
        )
        # A second failure in the same epoch and goal-state tells less: whatever was in the way may still be there.
        is_repeated = not is_achieved and bool(self._log[goal]) and self._log[goal][-1] == evidence
        belief.mix_with_prior(self._config.hazard)
        expected = belief.update(evidence, self._likelihood(attempt.skill), weight=0.5 if is_repeated else 1.0)
        self._log[goal].append(evidence)
        is_revised = self.most_probable(goal) != before
        if is_revised:
            self._changed_epoch[goal] = attempt.epoch
        return Finding(goal=goal, situation=_situation(attempt), expected=expected, is_revised=is_revised)

    def _doubt(self, goal: int, attempt: Attempt) -> None:
        """Trust a goal-state a little less where a goal that never came about did not come about once more.

        An expert without one success may be unskilled, or the goal not allowed here: each trial weighs a little, so
        that a search for the first success does not stay in one goal-state for ever.
        """
        self.beliefs[goal].update(_failure(goal, attempt), self._luck(BEGINNERS_LUCK))

    def _miss(self, goal: int, attempt: Attempt) -> Finding:
        """Trust a goal-state less where an expert that has been good did not even reach the place.

        Were its misses no evidence at all, one success for a strange reason (two objects between the jaws) could make
        the learner try for ever where nothing is to be had and no place is reached.
        """
        belief, before = self.beliefs[goal], self.most_probable(goal)
        p_hit = min(self._best_skill[goal], 1.0 - self._config.blocked_error)
        expected = belief.update(_failure(goal, attempt), self._luck(p_hit), weight=self._config.miss_weight)
        is_revised = self.most_probable(goal) != before
        if is_revised:
            self._changed_epoch[goal] = attempt.epoch
        return Finding(goal=goal, situation=_situation(attempt), expected=expected, is_revised=is_revised)

    def _luck(self, p_hit: float) -> Likelihood:
        return Likelihood(p_hit=p_hit, false_positive=self._config.false_positive)

    def _note_fleeting(self, attempt: Attempt) -> None:
        """Take in which goals held through a trial, and which did not."""
        if attempt.holds is None or attempt.holds_after is None:
            return
        for k, (held, holds) in enumerate(zip(attempt.holds, attempt.holds_after, strict=True)):
            if held and not holds:
                self._n_lasted[k] = LOST
            elif held and self._n_lasted[k] != LOST:
                self._n_lasted[k] += 1

    def _has_hands_full(self, attempt: Attempt) -> bool:
        """Whether something held before or after the trial that may come and go: a full hand takes nothing else."""
        holds = mask(attempt.holds or ()) | mask(attempt.holds_after or ())
        return any(holds >> k & 1 and n < LASTING for k, n in enumerate(self._n_lasted))

    def _likelihood(self, skill: float) -> Likelihood:
        """Return how telling an attempt is. An expert that was at the place fails less often than its skill says."""
        least = 0.5 if self._config.use_blocked_only else LEAST_SKILL
        p_hit = min(max(skill, least), 1.0 - self._config.blocked_error)
        return Likelihood(p_hit=p_hit, false_positive=self._config.false_positive)

    def _count_losses(self, attempt: Attempt) -> None:
        """Count which goals held before a goal was achieved, and which of them it lost."""
        if attempt.holds is None or attempt.holds_after is None:
            return
        for k, (held, holds) in enumerate(zip(attempt.holds, attempt.holds_after, strict=True)):
            if held and k != attempt.subgoal:
                at = (attempt.subgoal, k)
                self._carried[at] = (1.0 - 1.0 / N_CARRIED) * self._carried[at] + 1.0
                self._lost[at] = (1.0 - 1.0 / N_CARRIED) * self._lost[at] + float(not holds)

    # ----------------------------------------------------------------------------------------------------- predict

    def most_probable(self, goal: int) -> Needs:
        """Return a goal's most probable needs."""
        return self.beliefs[goal].most_probable

    def draw(self, rng: np.random.Generator) -> Callable[[int], Needs]:
        """Return a function that draws each goal's needs from the posterior once, when first asked."""
        drawn: dict[int, Needs] = {}

        def needs_of(goal: int) -> Needs:
            if goal not in drawn:
                drawn[goal] = self.beliefs[goal].sample(rng)
            return drawn[goal]

        return needs_of

    def predict_allowed(self, situation: Situation) -> np.ndarray:
        """Return the probability that each goal is allowed in a situation.  () -> (n,)"""
        return np.array([belief.predict_allowed(situation) for belief in self.beliefs])

    def plan(
        self, goal: int, start: Situation = START, needs_of: Callable[[int], Needs] | None = None
    ) -> tuple[int, ...] | None:
        """Return the cheapest sequence of goals that ends with the wanted one, or None where there is none.

        Where no order keeps all that must be on, what was achieved once is taken to be on for good.

        Args:
            goal: the wanted goal.
            start: the situation to start from.
            needs_of: what each goal is taken to need; the most probable if left out.
        """
        needs_of = needs_of or self.most_probable
        trials = [1.0 / max(skill, LEAST_SKILL) for skill in self._skill]
        plan = cheapest_plan(goal, start, needs_of, Effort(trials=trials, losses=self.losses().tolist()))
        if plan is not None:
            return plan
        kept = Situation(start.latched & ~(1 << goal), start.latched)
        return cheapest_plan(goal, kept, needs_of, Effort(trials=trials, losses=np.zeros_like(self._lost).tolist()))

    def losses(self) -> np.ndarray:
        """Return the chance that achieving goal j loses goal k.  () -> (n, n)"""
        return (self._lost + LOSS) / (self._carried + 1.0)

    def undone(self, goal: int) -> int:
        """Return the goals, as a bit mask, that achieving a goal is taken to lose."""
        return sum(1 << k for k, loss in enumerate(self.losses()[goal]) if loss >= 0.5)

    def is_known(self, goal: int, start: Situation) -> bool:
        """Whether there is a plan at whose end the goal is more probably allowed than not."""
        plan = self.plan(goal, start)
        return plan is not None and self.beliefs[goal].predict_allowed(self.follow(plan[:-1], start)) >= KNOWN

    def follow(self, steps: tuple[int, ...], start: Situation = START) -> Situation:
        """Return the situation after goals were achieved one after the other."""
        here = start
        for step in steps:
            here = here.after(step, self.undone(step))
        return here

    def dependents(self, goal: int) -> list[int]:
        """Return the goals that directly or indirectly need a goal, itself among them."""
        return [i for i in range(self.n_goals) if goal in relevant_goals(i, self.most_probable)]

    def skill(self, goal: int) -> float:
        """Return the chance of success of a goal's expert as it was last told."""
        return self._skill[goal]

    # -------------------------------------------------------------------------------------------------------- tell

    def evidence(self, goal: int) -> tuple[Evidence, ...]:
        """Return the newest evidence about a goal, oldest first."""
        return tuple(self._log[goal])

    def changed_epoch(self, goal: int) -> int | None:
        """Return the epoch in which a goal's most probable needs last changed; None where they never did."""
        return self._changed_epoch[goal]

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt."""
        return {
            "beliefs": [belief.state_dict() for belief in self.beliefs],
            "skill": list(self._skill),
            "came_about": list(self._came_about),
            "best_skill": list(self._best_skill),
            "n_lasted": list(self._n_lasted),
            "carried": self._carried.copy(),
            "lost": self._lost.copy(),
            "changed_epoch": list(self._changed_epoch),
            "log": [[msgspec.json.decode(msgspec.json.encode(evidence)) for evidence in kept] for kept in self._log],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        for belief, loaded in zip(self.beliefs, state["beliefs"], strict=True):
            belief.load_state_dict(loaded)
        self._skill = list(state["skill"])
        self._came_about = list(state["came_about"])
        self._best_skill = list(state["best_skill"])
        self._n_lasted = list(state["n_lasted"])
        self._carried = np.array(state["carried"], dtype=float)
        self._lost = np.array(state["lost"], dtype=float)
        self._changed_epoch = list(state["changed_epoch"])
        for kept, loaded in zip(self._log, state["log"], strict=True):
            kept.clear()
            kept.extend(msgspec.convert(loaded, list[Evidence]))


def _situation(attempt: Attempt) -> Situation:
    latched = mask(attempt.state)
    return Situation(latched if attempt.holds is None else latched & mask(attempt.holds), latched)


def _failure(goal: int, attempt: Attempt) -> Evidence:
    return Evidence(epoch=attempt.epoch, is_achieved=False, readings=_readings(goal, attempt, is_achieved=False))


def _readings(goal: int, attempt: Attempt, *, is_achieved: bool) -> tuple[Situation, ...]:
    """Return the situations that may have been in force when a goal came about, or did not.

    Where other goals came about in the same trial the order is unknown: before them, or after. Where a latched goal
    holds no longer (a thing was dropped) it is unknown whether it counts as on; a drop may also fall into the trial
    and be the very reason for its failure.
    """
    before = mask(attempt.state)
    after = before | mask(attempt.state_after) & ~(1 << goal)
    lost = before & ~_situation(attempt).holds
    if attempt.holds_after is not None and not is_achieved:
        lost |= before & ~mask(attempt.holds_after)
    readings = {Situation(latched & ~gone, latched) for latched in (before, after) for gone in (0, lost)}
    return tuple(sorted(readings))
