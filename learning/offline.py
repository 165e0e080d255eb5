"""What others did becomes what a learner knows, before it moves the arm itself. The edge: reads sessions.

Experts are shown the ways to their goals, and the ends of ways to other goals as places that were worth nothing to
them; the graph is shown what preceded what. Of the learner's own skill nothing is said: it finds that out online.
"""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np

from learning.agent import Agent
from learning.demonstrations import SURE, Shown, shown_in
from learning.experts import ExpertSet
from learning.interfaces import TrialOutcome
from learning.preceding import imagined, preceding
from robot.bus.topics import PERCEPT
from robot.messages import Percept, StationSpec
from robot.recording.errors import UnfitError
from robot.recording.messages import EpisodeEnd
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPISODE, RESET_MARK

__all__ = ["Origin", "Taught", "teach"]

STUDIED_TRIALS = 100
"""Trials' worth of training after all was shown."""
TAIL_STEPS = 20


class Origin(msgspec.Struct, frozen=True, kw_only=True):
    """Where something that was learnt comes from."""

    session: str
    sha256: str
    """Of the session's file."""
    epoch: int
    """Counted from 0 over all sessions, as the evidence bears it."""
    goal: int
    outcome: str
    begun_ns: int
    ended_ns: int
    n_steps: int


class Taught(msgspec.Struct, frozen=True, kw_only=True):
    """What a learner was shown."""

    n_sessions: int
    n_epochs: int
    ways_by_goal: tuple[int, ...]
    blocked_by_goal: tuple[int, ...]
    taken_to_need: tuple[tuple[int, ...], ...]
    """What came before each goal in nearly all ways to it (learning.preceding)."""
    origins: tuple[Origin, ...]


def teach(agent: Agent, experts: ExpertSet, spec: StationSpec, paths: Sequence[Path], *, scenario: str) -> Taught:
    """Show sessions to a learner that has learnt nothing yet.

    Args:
        agent: whose judge tells what came about, and whose graph is shown what preceded what.
        experts: the agent's.
        spec: of the station that the agent is for.
        paths: sessions of one scenario, of any rig, whoever moved the arm.
        scenario: the one that is to be learnt.

    Raises:
        UnfitError: a session is of another scenario, or shows nothing.
        DamagedError: one is torn.
    """
    shown: list[Shown] = []
    origins: list[Origin] = []
    n_epochs = 0
    for path in paths:
        digest = _digest(path)
        with SessionFile(path) as session:
            _check_fits(session, scenario)
            for percepts in _epochs_of(session):
                for found in shown_in(percepts, agent.judge, epoch=n_epochs, step_s=spec.step_s):
                    shown.append(found)
                    origins.append(_origin(found, path, digest, n_epochs))
                n_epochs += 1
    if not any(found.distances_m for found in shown):
        raise UnfitError(f"{paths[0]}: expected a goal that comes about in what is shown, none does")
    needs = preceding(shown, agent.n_goals)
    for attempt in (*(found.attempt for found in shown), *imagined(needs, epoch=n_epochs, skill=SURE)):
        agent.subgoal_selector.update(attempt)
    _show_ways(experts, shown, agent.n_goals)
    experts.study(STUDIED_TRIALS)
    return Taught(
        n_sessions=len(paths), n_epochs=n_epochs, origins=tuple(origins),
        ways_by_goal=_count(shown, agent.n_goals, TrialOutcome.ACHIEVED),
        blocked_by_goal=_count(shown, agent.n_goals, TrialOutcome.BLOCKED),
        taken_to_need=tuple(tuple(sorted(before)) for before in needs),
    )  # fmt: skip


def _show_ways(experts: ExpertSet, shown: Sequence[Shown], n_goals: int) -> None:
    for found in shown:
        if not found.distances_m:
            continue
        goal = found.attempt.subgoal
        distances, states = np.array(found.distances_m), np.array(found.states, dtype=np.float32)
        experts.demonstrate(goal, distances, states, is_success=True)
        for other in range(n_goals):
            if other != goal and not found.attempt.state_after[other]:
                tail = slice(-TAIL_STEPS, None)
                experts.demonstrate(other, distances[tail], states[tail], is_success=False)


def _epochs_of(session: SessionFile) -> Iterator[list[Percept]]:
    """Yield the percepts of each epoch that began with a reset, or of each episode that whoever drove has kept."""
    percepts: list[Percept] | None = None
    for topic, _, message in session.messages(RESET_MARK, PERCEPT, EPISODE):
        if topic is RESET_MARK or (topic is EPISODE and message.end is None):
            if percepts:
                yield percepts
            percepts = []
        elif topic is EPISODE:
            if percepts and message.end is EpisodeEnd.KEPT:
                yield percepts
            percepts = None
        elif percepts is not None:
            percepts.append(message)
    if percepts:
        yield percepts


def _check_fits(session: SessionFile, scenario: str) -> None:
    found = resolved_of(session).scenario.name
    if found != scenario:
        raise UnfitError(f"{session.path}: expected a session of scenario {scenario}, it is of {found}")


def _origin(found: Shown, path: Path, digest: str, epoch: int) -> Origin:
    return Origin(
        session=path.name, sha256=digest, epoch=epoch, goal=found.attempt.subgoal,
        outcome=found.attempt.outcome.value, begun_ns=found.begun_ns, ended_ns=found.ended_ns,
        n_steps=found.attempt.n_steps,
    )  # fmt: skip


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise UnfitError(f"{path}: expected a session's file, {(error.strerror or str(error)).lower()}") from error


def _count(shown: Sequence[Shown], n_goals: int, outcome: TrialOutcome) -> tuple[int, ...]:
    counted = [0] * n_goals
    for found in shown:
        counted[found.attempt.subgoal] += found.attempt.outcome is outcome
    return tuple(counted)
