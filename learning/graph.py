"""The learnt graph: what each goal is believed to need, how sure that is, and the plans that follow from it."""

from collections import deque
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from config.learning import SubgoalSelection
from learning.interfaces import Attempt, TrialOutcome
from learning.planning import Effort, cheapest_plan, relevant_goals
from learning.preconditions import START, Belief, Evidence, Kind, Needs, Situation, mask
from learning.revisions import Revisions

__all__ = ["Finding", "Graph", "situation_of"]

LEAST_SKILL = 0.05
KNOWN = 0.5
"""Least chance of being allowed at a plan's end for it to count as a known way."""
REPEATED_BLOCK, REPEATED_MISS = 0.5, 0.3
"""Weight of a failure that is the same as the one before."""
LOSS = 0.02
"""Chance that achieving a goal loses another, before it was ever seen."""
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
    believed: Needs
    """The goal's most probable needs before."""
    is_revised: bool
    """They are others now."""


class Graph:
    """A belief per goal, and what planning must know besides: skills, and which goals get lost again."""

    def __init__(self, *, n_goals: int, config: SubgoalSelection) -> None:
        self._config = config
        self._begin(n_goals)

    def _begin(self, n_goals: int) -> None:
        """Believe nothing yet of so many goals."""
        self.n_goals = n_goals
        self.beliefs = tuple(self._prior(g, n_goals) for g in range(n_goals))
        self._skill = [1.0] * n_goals
        self._carried = np.zeros((n_goals, n_goals))
        self._lost = np.zeros((n_goals, n_goals))
        """[j, k]: how often goal k held when goal j was achieved, and then held no longer."""
        self._tried = np.zeros((2, n_goals, n_goals))
        self._reached = np.zeros((2, n_goals, n_goals))
        """[h, i, j]: of the attempts at goal i while goal j held (h = 1) or did not, how many came to the place."""
        self._fair: list[list[float]] | None = None
        self._undone: list[int] | None = None
        """What was worked out of these counts already."""
        self._revisions = Revisions(self.beliefs)
        self._log = tuple(deque[Evidence](maxlen=N_EVIDENCE) for _ in range(n_goals))
        self._last: list[Evidence | None] = [None] * n_goals

    def _prior(self, goal: int, n_goals: int) -> Belief:
        config = self._config
        return Belief(
            n_goals=n_goals, goal=goal, max_literals=config.max_literals, literal_cost=config.literal_cost,
            false_positive=config.false_positive,
        )  # fmt: skip

    def grow(self, n_goals: int) -> None:
        """Take in new goals: the others keep what is believed of them, and may need the new ones, or their absence."""
        n_before, self.n_goals = self.n_goals, n_goals
        new = range(n_before, n_goals)
        self.beliefs = (
            *(belief.grown(n_goals) for belief in self.beliefs), *(self._prior(goal, n_goals) for goal in new)
        )  # fmt: skip
        self._skill += [1.0] * len(new)
        more = (0, len(new))
        self._carried, self._lost = (np.pad(counts, (more, more)) for counts in (self._carried, self._lost))
        self._tried, self._reached = (np.pad(n, ((0, 0), more, more)) for n in (self._tried, self._reached))
        self._fair = self._undone = None
        self._revisions.grow(self.beliefs)
        self._log = (*self._log, *(deque[Evidence](maxlen=N_EVIDENCE) for _ in new))
        self._last += [None] * len(new)

    # ------------------------------------------------------------------------------------------------------ learn

    def learn(self, attempt: Attempt) -> tuple[Finding, ...]:
        """Learn from one trial: from what was tried, and from what came about by accident."""
        tried, outcome = attempt.subgoal, attempt.outcome
        if outcome is TrialOutcome.VOID:
            return ()
        self._skill[tried] = attempt.skill
        findings: list[Finding] = []
        if outcome is TrialOutcome.ACHIEVED:
            self._count_losses(attempt)
            findings.append(self._update(tried, attempt, Kind.ACHIEVED))
        elif outcome is TrialOutcome.BLOCKED or not self._config.use_blocked_only:
            findings.append(self._update(tried, attempt, Kind.BLOCKED))
        elif self._config.miss_weight:
            findings.append(self._update(tried, attempt, Kind.MISSED))
        self._count_reached(attempt)
        for i, (was_on, is_on) in enumerate(zip(attempt.state, attempt.state_after, strict=True)):
            if is_on and not was_on and i != tried:
                findings.append(self._update(i, attempt, Kind.ACHIEVED))
        return tuple(findings)

    def _update(self, goal: int, attempt: Attempt, kind: Kind) -> Finding:
        belief, before = self.beliefs[goal], self.most_probable(goal)
        evidence = Evidence(epoch=attempt.epoch, kind=kind, readings=_readings(goal, attempt, kind))
        weight = self._weight(evidence, is_repeated=self._last[goal] == evidence)
        if kind is Kind.MISSED:
            weight *= self.freedom(goal, situation_of(attempt))
        if kind is not Kind.MISSED:
            belief.expect_change(self._config.hazard, local=self._config.local_change)
            self._log[goal].append(evidence)
        self._last[goal] = evidence
        expected = belief.update(evidence, block_hit=self._block_hit(attempt.skill), weight=weight)
        is_revised = self._revisions.note(goal, belief, attempt.epoch)
        return Finding(
            goal=goal, situation=situation_of(attempt), expected=expected, believed=before, is_revised=is_revised
        )

    def _weight(self, evidence: Evidence, *, is_repeated: bool) -> float:
        """Return how much evidence counts for.

        A second failure in the same epoch and goal-state tells less: whatever was in the way may still be there, and a
        clumsy expert repeats itself.
        """
        if evidence.kind is Kind.MISSED:
            return self._config.miss_weight * (REPEATED_MISS if is_repeated else 1.0)
        return REPEATED_BLOCK if is_repeated and evidence.kind is Kind.BLOCKED else 1.0

    def _block_hit(self, skill: float) -> float:
        """Return the chance of success at the place. An expert that came there fails less often than its skill says."""
        least = 0.5 if self._config.use_blocked_only else LEAST_SKILL
        return min(max(skill, least), 1.0 - self._config.blocked_error)

    def _count_losses(self, attempt: Attempt) -> None:
        """Count which goals held before a goal was achieved, and which of them it lost."""
        if attempt.holds is None or attempt.holds_after is None:
            return
        self._undone = None
        for k, (held, holds) in enumerate(zip(attempt.holds, attempt.holds_after, strict=True)):
            if held and k != attempt.subgoal:
                at = (attempt.subgoal, k)
                self._carried[at] = (1.0 - 1.0 / N_CARRIED) * self._carried[at] + 1.0
                self._lost[at] = (1.0 - 1.0 / N_CARRIED) * self._lost[at] + float(not holds)

    def _count_reached(self, attempt: Attempt) -> None:
        """Count whether an attempt came to its place, whatever it came to there, by what held meanwhile."""
        tried, holds = attempt.subgoal, situation_of(attempt).holds
        self._fair = None
        is_reached = attempt.outcome is not TrialOutcome.NOT_REACHED
        for j in range(self.n_goals):
            at = (holds >> j & 1, tried, j)
            self._tried[at] = (1.0 - 1.0 / N_CARRIED) * self._tried[at] + 1.0
            self._reached[at] = (1.0 - 1.0 / N_CARRIED) * self._reached[at] + is_reached

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

    def freedom(self, goal: int, situation: Situation) -> float:
        """Return how fair a try at a goal is in a situation: 1, less where what holds keeps its expert from the place.

        A full hand cannot take a second thing, whatever the rules are: such a miss says little about needs, and there
        is little to be found out by it. It is the least, over goals that hold, of the share of attempts that came to
        the place while that one held, over the same while it did not; (reached + 2) / (tried + 2), so at first 1.
        """
        shares, holds, least = self._shares()[goal], situation.holds, 1.0
        while holds:
            bit = holds & -holds
            holds ^= bit
            least = min(least, shares[bit.bit_length() - 1])
        return least

    def _shares(self) -> list[list[float]]:
        """Return [i][j]: how often goal i's place was reached while j held, over the same while it did not."""
        if self._fair is not None:
            return self._fair
        without, held = (self._reached + 2.0) / (self._tried + 2.0)  # (n, n), (n, n)
        shares: list[list[float]] = (held / without).tolist()
        self._fair = shares
        return shares

    def undone(self, goal: int) -> int:
        """Return the goals, as a bit mask, that achieving a goal is taken to lose."""
        if self._undone is None:
            self._undone = [sum(1 << k for k, loss in enumerate(row) if loss >= 0.5) for row in self.losses().tolist()]
        return self._undone[goal]

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
        """Return the newest evidence about a goal, misses left out, oldest first."""
        return tuple(self._log[goal])

    def changed_epoch(self, goal: int) -> int | None:
        """Return the epoch in which a goal's most probable needs last changed; None where they never did.

        Needs that come back after a doubt in which no others took hold have their old epoch again.
        """
        return self._revisions.epoch(goal)

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt."""
        return {
            "beliefs": [belief.state_dict() for belief in self.beliefs],
            "skill": list(self._skill),
            "carried": self._carried.copy(),
            "lost": self._lost.copy(),
            "tried": self._tried.copy(),
            "reached": self._reached.copy(),
            "revisions": self._revisions.state_dict(),
            "log": [[_plain(evidence) for evidence in kept] for kept in self._log],
            "last": [None if evidence is None else _plain(evidence) for evidence in self._last],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        if len(state["beliefs"]) != self.n_goals:
            self._begin(len(state["beliefs"]))
        for belief, loaded in zip(self.beliefs, state["beliefs"], strict=True):
            belief.load_state_dict(loaded)
        self._skill = list(state["skill"])
        self._carried = np.array(state["carried"], dtype=float)
        self._lost = np.array(state["lost"], dtype=float)
        self._tried = np.array(state["tried"], dtype=float)
        self._reached = np.array(state["reached"], dtype=float)
        self._fair = self._undone = None
        self._revisions.load_state_dict(state["revisions"])
        for kept, loaded in zip(self._log, state["log"], strict=True):
            kept.clear()
            kept.extend(msgspec.convert(loaded, list[Evidence]))
        self._last = msgspec.convert(state["last"], list[Evidence | None])


def _plain(evidence: Evidence) -> Any:  # noqa: ANN401 - a JSON tree
    return msgspec.json.decode(msgspec.json.encode(evidence))


def situation_of(attempt: Attempt) -> Situation:
    """Return the situation before a trial."""
    latched = mask(attempt.state)
    return Situation(latched if attempt.holds is None else latched & mask(attempt.holds), latched)


def _readings(goal: int, attempt: Attempt, kind: Kind) -> tuple[Situation, ...]:
    """Return the situations that may have been in force when a goal came about, or did not.

    Where other goals came about in the same trial the order is unknown: before them, or after. Where a latched goal
    holds no longer (a thing was dropped) it is unknown whether it counts as on; a drop may also fall into the trial
    and be the very reason for its failure.
    """
    before = mask(attempt.state)
    after = before | mask(attempt.state_after) & ~(1 << goal)
    lost = before & ~situation_of(attempt).holds
    if attempt.holds_after is not None and kind is not Kind.ACHIEVED:
        lost |= before & ~mask(attempt.holds_after)
    readings = {Situation(latched & ~gone, latched) for latched in (before, after) for gone in (0, lost)}
    return tuple(sorted(readings))
