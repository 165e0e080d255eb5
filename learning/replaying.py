"""A session through the learner again: what was perceived and what came of it, in place of a world.

The learner decides anew; each intent must be the recorded one to the last bit, or the replay ends there in words. What
is learnt in the end is compared with what the live learner had learnt, by fingerprints.
"""

from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from time import perf_counter, process_time

import msgspec
import torch

from learning.agent import Agent
from learning.assembly import build_agent
from learning.checkpoint import decode
from learning.errors import LearningError
from learning.fingerprint import fingerprint
from robot.bus.topics import PERCEPT
from robot.messages import Intent, Percept, StationMode, StationSpec, StationState, StepResult
from robot.recording.errors import UnfitError
from robot.recording.messages import Asked, Kept, Purpose, ResetMark, StationMark, StepMark
from robot.recording.origin import resolved_of
from robot.recording.recording import STATE
from robot.recording.session_file import SessionFile
from robot.recording.topics import INTENT, KEPT, RESET_MARK, STATION, STEP

__all__ = ["DivergedError", "EndedError", "Replayed", "ReplayedStation", "replay_session", "replay_to_learning"]


class EndedError(LearningError):
    """The session is over."""


class DivergedError(LearningError):
    """The learner decided otherwise than it had."""


class Replayed(msgspec.Struct, frozen=True, kw_only=True):
    """What a replay came to."""

    n_epochs: int
    n_steps: int
    n_compared: int
    """Fingerprints of the live learner that were compared, each after one epoch more at least."""
    is_identical: bool
    """All of them, one at least, were the replayed learner's too, and no decision was another."""
    diverged: str
    """Where it went another way, in words; empty where it did not."""
    n_done: int
    sha256: str
    """Of what is learnt in the end."""
    recorded_s: float
    """Time steps of the epochs that were replayed, as the arm took them."""
    seconds: float
    processor_s: float
    """Of the processor: a machine that does other things besides stretches the wall's."""

    @property
    def is_same(self) -> bool:
        """Whether it came to the same."""
        return self.is_identical

    @property
    def over_real_time(self) -> float:
        """How much faster it was than the arm."""
        return self.recorded_s / self.seconds if self.seconds else 0.0

    def told(self) -> dict[str, object]:
        """Return all of it, for a script."""
        return {**msgspec.structs.asdict(self), "over_real_time": self.over_real_time}

    def lines(self) -> Iterator[str]:
        """Yield it in words."""
        yield f"{self.n_epochs} epochs, {self.n_steps} time steps, {self.over_real_time:.0f} times real time"
        if self.diverged:
            yield f"went another way: {self.diverged}"
        elif self.is_identical:
            yield f"identical to the live learner, {self.n_compared} fingerprints compared, the last {self.sha256[:16]}"
        else:
            yield f"nothing to compare it with; its fingerprint is {self.sha256[:16]}"


Told = Percept | ResetMark | StepMark | Asked | Kept | msgspec.Struct


class ReplayedStation:
    """Implements robot.station.Station: gives back what was recorded, and holds the learner to it.

    Args:
        session: what is replayed.
        spec: what the station was.
    """

    def __init__(self, session: SessionFile, spec: StationSpec) -> None:
        self._spec = spec
        self._told = _learnt_from(session)
        self._next = next(self._told, None)
        self._heard = sha256()
        self.n_steps = 0
        self.recorded_s = 0.0

    @property
    def spec(self) -> StationSpec:
        """What was known before the first step."""
        return self._spec

    @property
    def state(self) -> StationState:
        """It was engaged."""
        return StationState(mode=StationMode.ENGAGED)

    @property
    def heard(self) -> str:
        """Digest of what was given back, byte for byte."""
        return self._heard.hexdigest()

    def next_mark(self) -> Kept | ResetMark | None:
        """Return the fingerprint or the reset that comes next, past what belongs to an epoch that was cut short."""
        while self._next is not None:
            message, _ = self._next
            if isinstance(message, Kept | ResetMark):
                return message
            self._take()
        return None

    def take_mark(self) -> None:
        """Go past it."""
        self._take()

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Return the recorded first percept of an epoch.

        Raises:
            DivergedError: another epoch was laid out, or another table.
            EndedError: the session is over.
        """
        mark = self._take()
        if not isinstance(mark, ResetMark) or (mark.seed, mark.epoch) != (seed, epoch):
            raise DivergedError(f"epoch {epoch}: expected its reset with seed {seed}, the session has {_words(mark)}")
        return self._percept()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Return what the recorded time step came to.

        Raises:
            DivergedError: another intent was recorded.
            EndedError: the session is over.
        """
        asked = self._take()
        if not isinstance(asked, Asked) or asked.intent != intent or asked.duration_s != duration_s:
            raise DivergedError(f"time step {self.n_steps + 1}: expected {intent}, the session has {_words(asked)}")
        percept = self._percept()
        mark = self._take()
        if not isinstance(mark, StepMark):
            raise DivergedError(f"time step {self.n_steps + 1}: expected what it came to, got {_words(mark)}")
        self.n_steps += 1
        self.recorded_s += mark.executed.duration_s
        return StepResult(percept=percept, executed=mark.executed, verdicts=mark.verdicts, is_void=mark.is_void)

    def close(self) -> None:
        """There is nothing to release."""

    def _percept(self) -> Percept:
        percept = self._take()
        if not isinstance(percept, Percept):
            raise DivergedError(f"after time step {self.n_steps}: expected a percept, got {_words(percept)}")
        return percept

    def _take(self) -> Told:
        if self._next is None:
            raise EndedError("the session ends here")
        (told, payload), self._next = self._next, next(self._told, None)
        if isinstance(told, Percept | StepMark):
            self._heard.update(payload)
        return told


def replay_to_learning(path: Path, *, tell: Callable[[int], object] = lambda _: None) -> tuple[Replayed, Agent]:
    """Let a learner live through a session again, and return what came of it and the learner.

    Args:
        path: a session of `autotelic learn --record`.
        tell: told after each epoch how many are done.

    Raises:
        UnfitError: it is a session of something else.
        DamagedError: it is torn.
    """
    torch.set_num_threads(1)  # as in live learning: the number would change the sums
    with SessionFile(path) as session:
        agent, spec, n_done = _learner_of(session)
        station = ReplayedStation(session, spec)
        begun_s, begun_processor_s = perf_counter(), process_time()
        done = _live_through(agent, station, n_done, tell)
        seconds, processor_s = perf_counter() - begun_s, process_time() - begun_processor_s
    is_identical = done.n_compared > 0 and not done.diverged
    replayed = Replayed(
        n_epochs=done.n_done - n_done, n_steps=station.n_steps, n_compared=done.n_compared, is_identical=is_identical,
        diverged=done.diverged, n_done=done.n_done, sha256=fingerprint(agent.state_dict()),
        recorded_s=station.recorded_s, seconds=seconds, processor_s=processor_s,
    )  # fmt: skip
    return replayed, agent


def replay_session(path: Path) -> Replayed:
    """Let a learner live through a session again, and return what came of it alone."""
    return replay_to_learning(path)[0]


class _Done:
    """How far it came."""

    def __init__(self, n_done: int) -> None:
        self.n_done = self.n_before = n_done
        self.n_compared, self.diverged = 0, ""


def _live_through(agent: Agent, station: ReplayedStation, n_done: int, tell: Callable[[int], object]) -> _Done:
    done = _Done(n_done)
    try:
        while (mark := station.next_mark()) is not None:
            if isinstance(mark, Kept):
                station.take_mark()
                _compare(agent, station, mark, done)
                continue
            _expect(mark, done)
            agent.meet_goals(mark.epoch)
            goal = agent.choose_goal()
            agent.learn_epoch(station, epoch=mark.epoch, seed=mark.seed, goal=goal)
            done.n_done += 1
            tell(done.n_done)
    except EndedError:
        pass  # a session that was cut short: what came before its last epoch stands
    except DivergedError as error:
        done.diverged = str(error)
    return done


def _expect(mark: ResetMark, done: _Done) -> None:
    if mark.epoch != done.n_done:
        raise DivergedError(f"expected epoch {done.n_done} next, the session has epoch {mark.epoch}")


def _compare(agent: Agent, station: ReplayedStation, mark: Kept, done: _Done) -> None:
    if mark.n_done != done.n_done:
        raise DivergedError(
            f"expected a fingerprint after {done.n_done} epochs, the session has one after {mark.n_done}"
        )
    found = fingerprint(agent.state_dict())
    if found != mark.sha256:
        raise DivergedError(
            f"after {mark.n_done} epochs: expected what was learnt to have fingerprint {mark.sha256[:16]}, it has "
            f"{found[:16]}"
        )
    if mark.heard and station.heard != mark.heard:
        raise DivergedError(
            f"after {mark.n_done} epochs: what is learnt is the same, but percepts or outcomes are not what they were: "
            f"expected digest {mark.heard[:16]}, got {station.heard[:16]}"
        )
    done.n_compared += done.n_done > done.n_before


def _learner_of(session: SessionFile) -> tuple[Agent, StationSpec, int]:
    """Return a learner as it was when the session began, what its station was, and how many epochs were done."""
    about = session.about
    if about.get("purpose") != Purpose.LEARN:
        raise UnfitError(
            f"{session.path}: expected a session of `autotelic learn --record`, it is one of "
            f"{about.get('purpose', 'something else')}"
        )
    marks = [mark for _, _, mark in session.messages(STATION)]
    if not marks:
        raise UnfitError(f"{session.path}: expected what its station was, there is nothing")
    mark: StationMark = marks[0]
    resolved = resolved_of(session)
    agent = build_agent(resolved, mark.spec, seed=int(about["seed"]))
    state = session.attachment(STATE)
    if state is not None:
        agent.load_state_dict(decode(state))
    return agent, mark.spec, int(about.get("n_done", "0"))


def _learnt_from(session: SessionFile) -> Iterator[tuple[Told, bytes]]:
    """Yield what the learner learnt from, with its bytes; evaluations between epochs are left out."""
    is_learning = True
    for topic, raw, message in session.messages(RESET_MARK, PERCEPT, INTENT, STEP, KEPT):
        if topic is RESET_MARK:
            is_learning = message.purpose is Purpose.LEARN
        if is_learning or topic is KEPT:
            yield message, raw.payload


def _words(message: object) -> str:
    return type(message).__name__ if isinstance(message, Percept) else str(message)[:200]
