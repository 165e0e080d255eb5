"""What a session shows of goals, whoever moved the arm: ways to where a goal came about, and what preceded what. Pure.

Nobody marks anything: goals are judged on the recorded percepts, as they are while learning. An epoch is cut where a
goal comes about. What is before that, up to the goal before it, is the way to it. A visit to a goal's place that comes
to nothing is a blocked trial, as it is while learning.
"""

from collections.abc import Iterable, Iterator

import msgspec
import numpy as np

from learning.agent import GoalJudge
from learning.interfaces import Attempt, GoalState, TrialOutcome
from robot.messages import Percept

__all__ = ["SURE", "Shown", "shown_in"]

Array = np.ndarray

BLOCKED_STEPS = 3
"""As learning/config's blocked_after by default: so many time steps at the place to no effect."""
AFTER_STEPS = 6
"""A goal that comes about so soon after a visit was not blocked in it."""
SURE = 0.95
"""Chance of success at the place that somebody is taken to have who shows it."""
LATE = 1e-6


class Shown(msgspec.Struct, frozen=True, kw_only=True):
    """One way to a goal, or one visit to its place that came to nothing."""

    attempt: Attempt
    begun_ns: int
    ended_ns: int
    distances_m: tuple[tuple[float, ...], ...]
    """Of the percepts on the way, a time step apart, to the last; empty for a visit."""
    states: tuple[tuple[float, ...], ...]


class _Segment:
    """What was perceived since the goal before, or the reset."""

    def __init__(self, first: Percept, holding: GoalState, latched: GoalState) -> None:
        self.first, self.holding, self.latched = first, holding, latched
        self.held = holding
        """At its beginning."""
        self.way: list[Percept] = []
        self.n_at_place = [0] * len(holding)
        self.visits: list[tuple[int, int, Percept]] = []
        """Goal, time step at whose end it was over, and the percept there."""


def shown_in(percepts: Iterable[Percept], judge: GoalJudge, *, epoch: int, step_s: float) -> Iterator[Shown]:
    """Yield what one epoch shows, in its order.

    Args:
        percepts: from the reset on, at any rate.
        judge: judges goals.
        epoch: its number, as evidence bears it.
        step_s: how far apart the learner's percepts are.
    """
    segment: _Segment | None = None
    next_ns = 0.0
    for percept in percepts:
        now = judge.achieved(percept)
        if segment is None:
            segment = _Segment(percept, now, now)
            next_ns = percept.stamp_ns + (1.0 - LATE) * step_s * 1e9
            continue
        came_about = [g for g, (is_so, was_so) in enumerate(zip(now, segment.holding, strict=True)) if is_so > was_so]
        is_step = percept.stamp_ns >= next_ns
        if is_step or came_about:
            next_ns = percept.stamp_ns + (1.0 - LATE) * step_s * 1e9
            segment.way.append(percept)
            _visit(segment, judge, percept, now)
        if came_about:
            latched = tuple(a or b for a, b in zip(segment.latched, now, strict=True))
            yield from _blocked(segment, came_about, epoch)
            yield from (_achieved(segment, goal, now, latched, epoch) for goal in came_about)
            segment = _Segment(percept, now, latched)
        else:
            segment.holding = now
    if segment is not None:
        yield from _blocked(segment, [], epoch)


def _visit(segment: _Segment, judge: GoalJudge, percept: Percept, now: GoalState) -> None:
    """Count the time steps at each place, and note a visit that is over."""
    for goal, is_held in enumerate(now):
        if not is_held and judge.is_at_place(goal, percept):
            segment.n_at_place[goal] += 1
            continue
        if segment.n_at_place[goal] >= BLOCKED_STEPS:
            segment.visits.append((goal, len(segment.way), percept))
        segment.n_at_place[goal] = 0


def _blocked(segment: _Segment, came_about: list[int], epoch: int) -> Iterator[Shown]:
    """Yield visits that came to nothing: not those of a goal that came about just after."""
    for goal, at, percept in segment.visits:
        is_in_time = goal in came_about and len(segment.way) - at <= AFTER_STEPS
        if segment.latched[goal] or is_in_time:
            continue
        attempt = _attempt(segment, goal, segment.holding, segment.latched, epoch, TrialOutcome.BLOCKED)
        yield Shown(
            attempt=attempt, begun_ns=segment.first.stamp_ns, ended_ns=percept.stamp_ns, distances_m=(), states=()
        )


def _achieved(segment: _Segment, goal: int, now: GoalState, latched: GoalState, epoch: int) -> Shown:
    return Shown(
        attempt=_attempt(segment, goal, now, latched, epoch, TrialOutcome.ACHIEVED),
        begun_ns=segment.first.stamp_ns,
        ended_ns=segment.way[-1].stamp_ns,
        distances_m=tuple(p.distances_m for p in segment.way),
        states=tuple(p.button_states for p in segment.way),
    )


def _attempt(
    segment: _Segment, goal: int, now: GoalState, latched: GoalState, epoch: int, outcome: TrialOutcome
) -> Attempt:
    return Attempt(
        epoch=epoch, goal=goal, subgoal=goal, state=segment.latched, state_after=latched, outcome=outcome,
        holds=segment.held, holds_after=now, predicted=SURE, skill=SURE, n_steps=len(segment.way),
    )  # fmt: skip
