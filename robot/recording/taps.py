"""What listens to a tick loop and to a station, and hands what it hears to a recorder. Nothing of it comes back."""

from collections.abc import Callable
from hashlib import sha256
from typing import Any, Protocol

import msgspec

from robot.as_came import as_came
from robot.bus.topic import Topic
from robot.bus.topics import ARM_STATE, CAMERA_IMAGE, PERCEPT, REQUESTED, SENT, VERDICT
from robot.errors import RobotError
from robot.frames import Frame
from robot.messages import (
    ArmCommand,
    ArmState,
    Intent,
    Outcome,
    Percept,
    StationSpec,
    StationState,
    StepResult,
    Verdict,
)
from robot.recording.images import ImageCoder
from robot.recording.messages import Asked, EpisodeMark, Event, Purpose, ResetMark, StationMark, StepMark
from robot.recording.picture import Picture
from robot.recording.recorder import Recorder
from robot.recording.topics import EPISODE, EVENT, INTENT, RESET_MARK, SCENE, STATION, STEP, TF
from robot.station import Station
from robot.teleop.driver import DrivenStation

__all__ = ["Heard", "Now", "RecordedDrive", "RecordedStation", "RecordedTicks", "Writes", "WritesBytes"]

Now = Callable[[], int]
"""The session's clock."""


class Heard(Protocol):
    """A digest in the making, as hashlib has them."""

    def update(self, data: bytes, /) -> None:
        """Take bytes in."""
        ...

    def hexdigest(self) -> str:
        """Return it so far."""
        ...


class Writes(Protocol):
    """Takes messages of a session's topics."""

    def write(self, topic: Topic[Any], message: msgspec.Struct, *, log_ns: int, stamp_ns: int | None = None) -> bytes:
        """Take one, and return its payload."""
        ...


class WritesBytes(Writes, Protocol):
    """Takes them as bytes, too."""

    def encoded(self, message: msgspec.Struct) -> bytes:
        """Return the payload of a message whose numbers are finite."""
        ...

    def put(self, topic: Topic[Any], payload: bytes, *, log_ns: int, stamp_ns: int, has_words: bool = False) -> None:
        """Take one as its bytes."""
        ...


class RecordedTicks:
    """Implements robot.tick_tap.TickTap: measurement, request, what was sent and the verdict of every tick.

    Args:
        recorder: takes it.
        now_ns: the session's time; None is the arm's own, as measurements and commands are stamped with.
        images: compresses frames; None leaves them out.

    Attributes:
        state: The newest measurement.
        log_ns: The session's time of it.
    """

    def __init__(self, recorder: WritesBytes, *, now_ns: Now | None = None, images: ImageCoder | None = None) -> None:
        self._recorder, self._now_ns, self._images = recorder, now_ns, images
        self.state: ArmState | None = None
        self.log_ns = 0

    def measured(self, state: ArmState) -> None:
        """Record a measurement, once."""
        if self.state is not None and self.state.stamp_ns == state.stamp_ns:
            return
        self.state, self.log_ns = state, self._at(state.stamp_ns)
        self._recorder.write(ARM_STATE, state, log_ns=self.log_ns, stamp_ns=state.stamp_ns)

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Record a request, the verdict and, where it was sent, that: its numbers are finite then."""
        recorder, at, stamp_ns = self._recorder, self._at(command.stamp_ns), command.stamp_ns
        if verdict is not None:
            recorder.write(REQUESTED, command, log_ns=at, stamp_ns=stamp_ns)
            recorder.write(VERDICT, verdict, log_ns=at, stamp_ns=stamp_ns)
            return
        payload = recorder.encoded(command)
        recorder.put(REQUESTED, payload, log_ns=at, stamp_ns=stamp_ns)
        recorder.put(SENT, payload, log_ns=at, stamp_ns=stamp_ns)
        passed = Verdict(
            stamp_ns=stamp_ns, sequence=command.sequence, outcome=Outcome.LIMITED if limiters else Outcome.PASSED,
            reason=" ".join(limiters),
        )  # fmt: skip
        recorder.put(VERDICT, recorder.encoded(passed), log_ns=at, stamp_ns=stamp_ns)

    def refused(self, verdict: Verdict) -> None:
        """Record a refusal that was of no command."""
        self._recorder.write(VERDICT, verdict, log_ns=self._at(verdict.stamp_ns), stamp_ns=verdict.stamp_ns)

    def seen(self, frame: Frame) -> None:
        """Record a frame, compressed; robot.frame_tap.FrameTap."""
        if self._images is not None:
            image = self._images.encode(frame)
            self._recorder.write(CAMERA_IMAGE, image, log_ns=self._at(frame.arrival_ns), stamp_ns=frame.stamp_ns)

    def _at(self, stamp_ns: int) -> int:
        return max(self.log_ns, stamp_ns if self._now_ns is None else self._now_ns())


class RecordedStation:
    """Implements robot.station.Station around another station.

    Args:
        station: what is recorded.
        recorder: takes it.
        purpose: what epochs on it are for.
        ticks: tells the newest measurement; None where ticks are not heard here.
        picture: draws for viewers; None leaves that out.
        now_ns: the session's time; None is the percepts' own.
        heard: takes percepts and outcomes into a digest.
        measure: returns the newest measurement, where ticks are not heard here: it is recorded with every step, and so
            is the command that was sent last.
        more_ticks: records all ticks since it was called last, and tells whether nothing else of the arm need be.
    """

    def __init__(
        self,
        station: Station,
        recorder: Writes,
        *,
        purpose: Purpose,
        ticks: RecordedTicks | None = None,
        picture: Picture | None = None,
        now_ns: Now | None = None,
        heard: Heard | None = None,
        measure: Callable[[], ArmState] | None = None,
        more_ticks: Callable[[], bool] | None = None,
    ) -> None:
        self._measure, self._more_ticks = measure, more_ticks
        self._heard: Heard = heard or sha256()
        self._station, self._recorder, self._purpose = station, recorder, purpose
        self._ticks, self._picture, self._now_ns = ticks, picture, now_ns
        self._at_ns = 0

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return self._station.spec

    @property
    def state(self) -> StationState:
        """Mode and reason."""
        return self._station.state

    def begin(self, *, is_driven: bool) -> None:
        """Record what the station is."""
        self._recorder.write(STATION, StationMark(spec=self.spec, is_driven=is_driven), log_ns=self._time())

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch, and record that and the first percept."""
        mark = ResetMark(seed=seed, epoch=epoch, purpose=self._purpose)
        self._recorder.write(RESET_MARK, mark, log_ns=self._time())
        try:
            percept = self._station.reset(seed=seed, epoch=epoch)
        except RobotError as error:
            self._happened("reset failed", str(error))
            raise
        self._perceived(percept)
        return percept

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent, and record it and what it came to."""
        asked = Asked(intent=intent if isinstance(intent, Intent) else as_came(intent), duration_s=duration_s)
        self._recorder.write(INTENT, asked, log_ns=self._time())
        try:
            result = self._station.step(intent, duration_s=duration_s)
        except RobotError as error:
            self._happened("step failed", str(error))
            raise
        self._perceived(result.percept)
        is_needed = self._measure is not None and (self._more_ticks is None or not self._more_ticks())
        if is_needed and result.executed.sent is not None:
            self._recorder.write(SENT, result.executed.sent, log_ns=self._at_ns, stamp_ns=result.executed.sent.stamp_ns)
        mark = StepMark(executed=result.executed, verdicts=result.verdicts, is_void=result.is_void)
        self._heard.update(self._recorder.write(STEP, mark, log_ns=self._at_ns))
        if result.is_void:
            state = self.state
            self._happened(f"void, station {state.mode}", state.reason)
        return result

    def close(self) -> None:
        """Stop and release. Idempotent."""
        self._station.close()

    def _perceived(self, percept: Percept) -> None:
        at = self._time(percept)
        self._heard.update(self._recorder.write(PERCEPT, percept, log_ns=at, stamp_ns=percept.stamp_ns))
        state = None if self._ticks is None else self._ticks.state
        if self._measure is not None:
            state = self._measure()
            if self._more_ticks is None or not self._more_ticks():
                self._recorder.write(ARM_STATE, state, log_ns=at, stamp_ns=state.stamp_ns)
        if self._picture is None:
            return
        frames = self._picture.frames(state, percept)
        self._recorder.write(TF, frames, log_ns=at, stamp_ns=percept.stamp_ns)
        scene = self._picture.scene(percept)
        if scene is not None:
            self._recorder.write(SCENE, scene, log_ns=at, stamp_ns=percept.stamp_ns)

    def _happened(self, what: str, detail: str) -> None:
        self._recorder.write(EVENT, Event(what=what, detail=detail), log_ns=self._time())

    def _time(self, percept: Percept | None = None) -> int:
        """Return the session's time, which never goes back."""
        if self._now_ns is not None:
            at = self._now_ns()
        else:
            at = max(0 if percept is None else percept.stamp_ns, 0 if self._ticks is None else self._ticks.log_ns)
        self._at_ns = max(self._at_ns, at)
        return self._at_ns


class RecordedDrive(RecordedStation):
    """A recorded station that a driver holds: it tells what its arm measured, too."""

    def __init__(
        self,
        station: DrivenStation,
        recorder: Recorder,
        *,
        ticks: RecordedTicks,
        picture: Picture,
        now_ns: Now | None,
        measure: Callable[[], ArmState] | None,
        more_ticks: Callable[[], bool] | None = None,
    ) -> None:
        super().__init__(
            station, recorder, purpose=Purpose.DRIVE, ticks=ticks, picture=picture, now_ns=now_ns, measure=measure,
            more_ticks=more_ticks,
        )  # fmt: skip
        self._driven = station

    def mark(self, mark: EpisodeMark) -> None:
        """Record where an episode begins or ends."""
        self._recorder.write(EPISODE, mark, log_ns=self._time())

    @property
    def measured(self) -> ArmState:
        """The newest measurement."""
        return self._driven.measured

    @property
    def percept(self) -> Percept:
        """What was perceived last."""
        return self._driven.percept
