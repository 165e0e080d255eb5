"""The agent: three layers at three time scales. An epoch has a goal, a trial a sub-goal, a time step an intent.

Read it as the paper tells it: the goal selector chooses at each epoch, the sub-goal selector at each trial, the
sub-goal's expert at each time step. What was achieved in an epoch stays achieved (latched) until the next reset.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import msgspec

from config.learning import Experiment
from learning.errors import LearningError
from learning.interfaces import Attempt, Experts, GoalState, Grows, Kept, Late, SubgoalSelector, TrialOutcome
from learning.looking import ways_to_look
from learning.stopwatch import Stopwatch
from robot.messages import Heading, Percept
from robot.station import Station

__all__ = ["Agent", "EpochRecord", "GoalJudge", "GoalSelector", "TrialRecord", "Witness"]

RETREAT_STEPS = 20
RISEN_WITHIN_M = 0.012


class GoalSelector(Kept, Protocol):
    """The bandit over goals, and the competence that sets the sub-goal selector's temperature."""

    def select(self) -> int:
        """Return the goal of the next epoch."""
        ...

    def temperature(self, goal: int) -> float:
        """Return the temperature of the sub-goal choice while pursuing a goal."""
        ...

    def update(self, attempt: Attempt) -> None:
        """Learn from one trial."""
        ...

    def end_epoch(self, goal: int, *, predicted: float, is_achieved: bool) -> None:
        """Learn from one epoch; predicted is the chance of its goal said at the epoch's start."""
        ...

    def rearm(self, goals: Iterable[int]) -> None:
        """Take up goals again whose believed needs have changed."""
        ...


class GoalJudge(Protocol):
    """Judges goals on the percept. Keeps no memory."""

    @property
    def n_goals(self) -> int:
        """How many goals there are."""
        ...

    def achieved(self, percept: Percept) -> GoalState:
        """Return which goals hold now."""
        ...

    def known(self, percept: Percept, *, since_ns: int | None = None) -> GoalState:
        """Return of which goals it is known whether they hold, by what was seen since."""
        ...

    def is_hand_free(self, goal: int, percept: Percept) -> bool:
        """Whether the hand holds nothing but what the goal is about: with another thing in it no try is a fair one."""
        ...

    def is_at_place(self, goal: int, percept: Percept) -> bool:
        """Whether the tool is where the goal should come about, hand free (or full) as it must be."""
        ...


class Witness(Protocol):
    """Hears what is decided and what becomes of it, for a recording. Nothing of it comes back."""

    def epoch_begun(self, epoch: int, goal: int) -> None:
        """A goal was chosen."""
        ...

    def subgoal_chosen(self, *, epoch: int, trial: int, goal: int, subgoal: int) -> None:
        """A sub-goal was chosen."""
        ...

    def trial_ended(self, record: "TrialRecord") -> None:
        """A trial is over."""
        ...

    def epoch_ended(self, record: "EpochRecord") -> None:
        """An epoch is over."""
        ...


class TrialRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One trial."""

    trial: int
    """Counted from 1 within the epoch."""
    attempt: Attempt
    temperature: float
    """Temperature of the sub-goal choice."""


class EpochRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One epoch."""

    epoch: int
    goal: int
    is_achieved: bool
    is_void: bool
    """Cut short: evidence about nothing."""
    trials: tuple[TrialRecord, ...]

    @property
    def n_steps(self) -> int:
        """Time steps of all trials."""
        return sum(record.attempt.n_steps for record in self.trials)


class _Scene:
    """What holds in the epoch in hand."""

    def __init__(self, percept: Percept, holding: GoalState) -> None:
        self.percept = percept
        self.holding = holding
        """Goals that hold now."""
        self.latched = holding
        """Goals that held at some time in this epoch."""

    def available(self) -> tuple[bool, ...]:
        """Which goals may be pursued: not achieved yet, or true no longer (a dropped object may be taken again)."""
        return tuple(not held for held in self.holding)


class Agent:
    """Composes goal selector, sub-goal selector, experts and goal judge."""

    def __init__(
        self,
        *,
        goal_selector: GoalSelector,
        subgoal_selector: SubgoalSelector,
        experts: Experts,
        judge: GoalJudge,
        protocol: Experiment,
        stopwatch: Stopwatch | None = None,
        arrivals: Sequence[int] = (),
    ) -> None:
        """Put the layers together, made for the goals of the first epoch.

        Arrivals are the epochs from which each goal is known, in order; empty: all from the first.
        """
        self._arrivals = tuple(arrivals)
        self.goal_selector = goal_selector
        self.subgoal_selector = subgoal_selector
        self.experts = experts
        self.judge = judge
        self._protocol = protocol
        self._stopwatch = stopwatch or Stopwatch()
        if self._arrivals:
            self._let_judge_know(self._n_known(0))
        self.witness: Witness | None = None
        """Hears of everything."""

    @property
    def n_goals(self) -> int:
        """How many goals are known."""
        return self.judge.n_goals

    def meet_goals(self, epoch: int) -> tuple[int, ...]:
        """Take in the goals that become known in an epoch that is about to begin, and return them.

        Raises:
            LearningError: a layer cannot take in any.
        """
        n_before, n_goals = self.n_goals, self._n_known(epoch)
        if n_goals <= n_before:
            return ()
        for layer in (self.goal_selector, self.subgoal_selector, self.experts):
            if not isinstance(layer, Grows):
                raise LearningError(f"expected layers that take in new goals, {type(layer).__name__} does not")
            layer.grow(n_goals)
        self._let_judge_know(n_goals)
        return tuple(range(n_before, n_goals))

    def _nothing(self) -> GoalState:
        return (False,) * self.n_goals

    def _n_known(self, epoch: int) -> int:
        return sum(start <= epoch for start in self._arrivals) if self._arrivals else self.n_goals

    def _let_judge_know(self, n_goals: int) -> None:
        assert isinstance(self.judge, Grows), "who is told of arrivals judges by a scenario"
        self.judge.grow(n_goals)

    def choose_goal(self) -> int:
        """Return the goal of the next epoch."""
        goal = self.goal_selector.select()
        self._stopwatch.lap("selectors")
        return goal

    def learn_epoch(self, station: Station, *, epoch: int, seed: int, goal: int) -> EpochRecord:
        """Lay the table out and pursue a goal for up to eight trials, learning."""
        if self.witness is not None:
            self.witness.epoch_begun(epoch, goal)
        scene = self._reset(station, epoch=epoch, seed=seed)
        predicted = self.experts.utility(goal, scene.percept)
        record = self._run_epoch(station, scene, epoch=epoch, goal=goal, explore=True)
        if not record.is_void:
            self.goal_selector.end_epoch(goal, predicted=predicted, is_achieved=record.is_achieved)
        self._stopwatch.lap("selectors")
        if self.witness is not None:
            self.witness.epoch_ended(record)
        return record

    def test_epoch(self, station: Station, *, epoch: int, seed: int, goal: int) -> EpochRecord:
        """Pursue a given goal with learning off: nothing is drawn, nothing learnt changes."""
        if self.witness is not None:
            self.witness.epoch_begun(epoch, goal)
        scene = self._reset(station, epoch=epoch, seed=seed)
        record = self._run_epoch(station, scene, epoch=epoch, goal=goal, explore=False)
        if self.witness is not None:
            self.witness.epoch_ended(record)
        return record

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generators' states, and how many goals are known while not all are."""
        known = {"n_goals": self.n_goals} if self.n_goals < len(self._arrivals) else {}
        return known | {
            "goal_selector": self.goal_selector.state_dict(),
            "subgoal_selector": self.subgoal_selector.state_dict(),
            "experts": self.experts.state_dict(),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit, with as many goals known as then."""
        if self._arrivals:
            self._let_judge_know(state.get("n_goals", len(self._arrivals)))
        self.goal_selector.load_state_dict(state["goal_selector"])
        self.subgoal_selector.load_state_dict(state["subgoal_selector"])
        self.experts.load_state_dict(state["experts"])

    # ------------------------------------------------------------------------------------------------------- epoch

    def _reset(self, station: Station, *, epoch: int, seed: int) -> _Scene:
        percept = station.reset(seed=seed, epoch=epoch)
        self._stopwatch.lap("reset")
        return _Scene(percept, self.judge.achieved(percept))

    def _run_epoch(self, station: Station, scene: _Scene, *, epoch: int, goal: int, explore: bool) -> EpochRecord:
        records: list[TrialRecord] = []
        while not scene.latched[goal] and len(records) < self._protocol.trials:
            if records and not self._retreat(station, scene):
                return EpochRecord(epoch=epoch, goal=goal, is_achieved=False, is_void=True, trials=tuple(records))
            if scene.latched[goal]:  # it came about on the way up
                break
            record = self._run_trial(station, scene, epoch=epoch, goal=goal, trial=len(records) + 1, explore=explore)
            records.append(record)
            if self.witness is not None:
                self.witness.trial_ended(record)
            if record.attempt.outcome is TrialOutcome.VOID:
                break
            if explore:
                self._learn(record.attempt)
        is_void = bool(records) and records[-1].attempt.outcome is TrialOutcome.VOID
        is_achieved = scene.latched[goal] and not is_void
        return EpochRecord(epoch=epoch, goal=goal, is_achieved=is_achieved, is_void=is_void, trials=tuple(records))

    def _learn(self, attempt: Attempt) -> None:
        self.goal_selector.update(attempt)
        self.subgoal_selector.update(attempt)
        self.goal_selector.rearm(self.subgoal_selector.changed_goals())
        self._stopwatch.lap("selectors")

    # ------------------------------------------------------------------------------------------------------- trial

    def _run_trial(
        self, station: Station, scene: _Scene, *, epoch: int, goal: int, trial: int, explore: bool
    ) -> TrialRecord:
        state, holds = scene.latched, scene.holding
        temperature = self.goal_selector.temperature(goal)
        subgoal = self.subgoal_selector.select(
            goal=goal, state=state, available=scene.available(), temperature=temperature, explore=explore
        )
        if self.witness is not None:
            self.witness.subgoal_chosen(epoch=epoch, trial=trial, goal=goal, subgoal=subgoal)
        self._stopwatch.lap("selectors")
        predicted = self.experts.utility(subgoal, scene.percept)
        skill = self.experts.skill(subgoal)
        is_fair = self.judge.is_hand_free(subgoal, scene.percept)
        self.experts.begin_trial(subgoal, scene.percept, explore=explore)
        outcome, n_steps = self._pursue(station, scene, subgoal)
        late = None
        if outcome in (TrialOutcome.BLOCKED, TrialOutcome.NOT_REACHED):
            outcome, is_known, late = self._look_again(station, scene, subgoal, outcome)
            is_fair = is_fair and is_known
        self.experts.end_trial(outcome, is_fair=is_fair, late=late)
        self._stopwatch.lap("training")
        attempt = Attempt(
            epoch=epoch,
            goal=goal,
            subgoal=subgoal,
            state=state,
            state_after=scene.latched,
            holds=holds,
            holds_after=scene.holding,
            outcome=outcome,
            predicted=predicted,
            skill=skill,
            n_steps=n_steps,
            is_explored=self.experts.is_exploring,
        )
        return TrialRecord(trial=trial, attempt=attempt, temperature=temperature)

    def _retreat(self, station: Station, scene: _Scene) -> bool:
        """Rise to travel height, so that a trial begins where nothing is in the way; return False where it was void."""
        if not self._protocol.retreat:
            return True
        height = station.spec.heights_m[1]
        high_enough = station.spec.table_height_m + height - RISEN_WITHIN_M
        for _ in range(RETREAT_STEPS):
            if scene.percept.tcp_position_m[2] >= high_enough:
                break
            result = station.step(Heading(heading_rad=0.0, distance_m=0.0, height_m=height))
            if result.is_void:
                return False
            self._take_in(scene, result.percept)
        self._stopwatch.lap("stack")
        return True

    def _pursue(self, station: Station, scene: _Scene, subgoal: int) -> tuple[TrialOutcome, int]:
        """Let the sub-goal's expert move the arm until the trial ends."""
        lap, experts, protocol = self._stopwatch.lap, self.experts, self._protocol
        n_at_place, is_blocked = 0, False
        for step in range(1, protocol.steps + 1):
            intent = experts.act(scene.percept)
            lap("experts")
            result = station.step(intent)
            lap("stack")
            if result.is_void:
                return TrialOutcome.VOID, step
            came_about = self._take_in(scene, result.percept)
            lap("judge")
            experts.observe(result, came_about)
            lap("experts")
            if scene.holding[subgoal]:
                return TrialOutcome.ACHIEVED, step
            n_at_place += self.judge.is_at_place(subgoal, scene.percept)
            lap("judge")
            is_blocked = is_blocked or n_at_place >= protocol.blocked_after
            if is_blocked and protocol.end_blocked:
                return TrialOutcome.BLOCKED, step
        return TrialOutcome.BLOCKED if is_blocked else TrialOutcome.NOT_REACHED, protocol.steps

    def _look_again(
        self, station: Station, scene: _Scene, subgoal: int, outcome: TrialOutcome
    ) -> tuple[TrialOutcome, bool, Late | None]:
        """Move away until it is seen what the trial came to; return that, whether it was seen, and what came about.

        Where the percept tells already, as ground truth always does, nothing is moved. A goal that cannot be seen even
        so was not achieved, as far as is known, and its trial was no fair try: it is no evidence against the skill, and
        no proof that something blocked it.
        """
        end, came_about = scene.percept, self._nothing()
        for way in ways_to_look(station.spec):
            if self.judge.known(scene.percept, since_ns=end.stamp_ns)[subgoal]:
                break
            result = station.step(way)
            if result.is_void:
                return TrialOutcome.VOID, False, None
            new = self._take_in(scene, result.percept)
            came_about = tuple(was or is_so for was, is_so in zip(came_about, new, strict=True))
        self._stopwatch.lap("stack")
        if scene.percept is end:
            return outcome, True, None
        late = Late(end, came_about)
        if came_about[subgoal]:
            return TrialOutcome.ACHIEVED, True, late
        is_known = self.judge.known(scene.percept, since_ns=end.stamp_ns)[subgoal]
        return outcome if is_known else TrialOutcome.NOT_REACHED, is_known, late

    def _take_in(self, scene: _Scene, percept: Percept) -> GoalState:
        """Judge the goals, latch them and return those that came about in this very step.

        A goal that nothing tells of holds if it held before: what is hidden has not changed, as far as is known.
        """
        before, now = scene.holding, self.judge.achieved(percept)
        known = self.judge.known(percept)
        if not all(known):
            now = tuple(new if is_known else old for new, old, is_known in zip(now, before, known, strict=True))
        scene.percept = percept
        if now == before:
            return self._nothing()
        scene.holding = now
        scene.latched = tuple(was_so or is_so for was_so, is_so in zip(scene.latched, now, strict=True))
        return tuple(is_so and not was_so for is_so, was_so in zip(now, before, strict=True))
