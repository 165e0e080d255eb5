"""The drive loop: look at the device, make an intent, carry it out, tell. Ends with the arm at rest."""

from collections.abc import Callable
from typing import Protocol

import msgspec

from robot.errors import NotEngagedError, SafetyError
from robot.messages import ArmState, Hold, Intent, Percept, StationMode, StationState, StepResult, Vec3, Verdict
from robot.station import Station
from robot.teleop.device import Device, DriverInput, EpisodeKey
from robot.teleop.jog import Jog

__all__ = ["DriveEnd", "DriveView", "DrivenStation", "Driver", "Pace", "Preview", "Rearms", "Unpaced"]

REST_S = 2.0
"""How long the arm may take to come to rest at the end before the driver lets go of it anyway: the gate stops it."""
STILL_RAD_S = 2e-3


class DrivenStation(Station, Protocol):
    """A station that also tells what its arm measured."""

    @property
    def measured(self) -> ArmState:
        """The newest measurement."""
        ...

    @property
    def percept(self) -> Percept:
        """What was perceived last."""
        ...


class Pace(Protocol):
    """The driver's time: it says what time it is, and lets a step's time pass where the plant does not."""

    def now_ns(self) -> int:
        """Return the driver's time."""
        ...

    def wait_step(self) -> None:
        """Wait for the end of the step in hand."""
        ...


class Preview(Protocol):
    """What tries intents before they are sent."""

    def offer(self, intent: Intent, measured: ArmState, percept: Percept) -> tuple[Intent, Verdict | None]:
        """Return what may be sent now, and why it is not what was asked where it was refused."""
        ...


class DriveView(msgspec.Struct, frozen=True, kw_only=True):
    """What a driver is shown after a step."""

    state: StationState
    asked: DriverInput
    sent: Intent
    """What was asked of the station."""
    resting: str
    """Why the arm rests; empty where it moves."""
    gain: float
    age_s: float
    """Of what the device said last."""
    measured: ArmState
    result: StepResult | None
    refused: Verdict | None
    """What the preview would not let through."""
    step_s: float
    n_steps: int


class DriveEnd(msgspec.Struct, frozen=True, kw_only=True):
    """What a drive came to."""

    n_steps: int
    n_latches: int
    is_at_rest: bool
    tcp_m: Vec3
    """Where the tool was in the end."""
    limited: dict[str, int]
    """Steps that each limiter had a hand in."""


Rearms = Callable[[StationState], bool]
"""Asks a person, after a latch, to look and to arm again; False where nobody does."""


class Unpaced:
    """Implements Pace for a plant whose steps take their time themselves, or for a script as fast as a twin goes.

    Args:
        now_ns: the time; steps are counted in its place where it is None, so that a drive repeats bit for bit.
        step_s: how long a step is.
    """

    def __init__(self, *, step_s: float, now_ns: Callable[[], int] | None = None) -> None:
        self._step_ns, self._wall_ns, self._n_steps = round(step_s * 1e9), now_ns, 0

    def now_ns(self) -> int:
        """Return the time, or the steps so far times their length."""
        return self._n_steps * self._step_ns if self._wall_ns is None else self._wall_ns()

    def wait_step(self) -> None:
        """Count the step."""
        self._n_steps += 1


class Driver:
    """Drives one station by one device until the driver is done or somebody asks to stop.

    Args:
        station: engaged; what latches is asked about, never cleared here.
        device: connected to and closed here.
        jog: what makes intents.
        pace: the driver's time.
        step_s: how long an intent lasts.
        rearm: asks a person after a latch.
        tell: shown every step.
        should_stop: whether somebody asked to end, as by Ctrl-C.
        preview: tries intents first, where wanted.
        end_episode: ends an episode as the driver says, and begins the next; the arm is at rest.
    """

    def __init__(
        self,
        *,
        station: DrivenStation,
        device: Device,
        jog: Jog,
        pace: Pace,
        step_s: float,
        rearm: Rearms,
        tell: Callable[[DriveView], None] = lambda _: None,
        should_stop: Callable[[], bool] = lambda: False,
        preview: Preview | None = None,
        end_episode: Callable[[EpisodeKey], object] = lambda _: None,
    ) -> None:
        self._station, self._device, self._jog, self._pace = station, device, jog, pace
        self._step_s, self._rearm, self._tell = step_s, rearm, tell
        self._should_stop, self._preview, self._end_episode = should_stop, preview, end_episode
        self._n_steps = self._n_latches = 0
        self._limited: dict[str, int] = {}

    def run(self) -> DriveEnd:
        """Drive to the end, and leave the arm at rest.

        Raises:
            SafetyError: it latched and nobody armed it again.
            RobotError: the device is not there, or the station was lost.
        """
        self._device.connect()
        try:
            self._take_over()
            while not self._should_stop():
                asked = self._device.read()
                if asked.is_over or not self._is_driving(asked):
                    break
                if asked.episode is not None and self._come_to_rest():
                    self._end_episode(asked.episode)
                    self._take_over()
                self._pace.wait_step()
            is_at_rest = self._come_to_rest()
        finally:
            self._device.close()
        return DriveEnd(
            n_steps=self._n_steps,
            n_latches=self._n_latches,
            is_at_rest=is_at_rest,
            tcp_m=self._station.measured.tcp_position_m,
            limited=dict(self._limited),
        )

    def _take_over(self) -> None:
        """Begin at rest where the arm is, with the hand as it is."""
        self._jog.reset()

    def _is_driving(self, asked: DriverInput) -> bool:
        """Carry out one step; after a latch ask a person. False where the drive is over."""
        if self._station.state.mode is not StationMode.ENGAGED:
            return self._after_latch()
        now_ns = self._pace.now_ns()
        measured = self._station.measured
        intent: Intent = self._jog.decide(asked, now_ns=now_ns, tcp_quat=measured.tcp_quat)
        refused = None
        if self._preview is not None:
            intent, refused = self._preview.offer(intent, measured, self._station.percept)
        result = self._step(intent)
        self._show(asked, intent, now_ns, result, refused)
        return True

    def _step(self, intent: Intent) -> StepResult | None:
        try:
            result = self._station.step(intent, duration_s=self._step_s)
        except NotEngagedError:
            return None  # command was lost between two steps; the next look at the state says why
        self._n_steps += 1
        for name in result.executed.limiters:
            self._limited[name] = self._limited.get(name, 0) + 1
        return result

    def _after_latch(self) -> bool:
        """Tell why, give the device back while the person types, and begin anew when it was armed again.

        Raises:
            SafetyError: nobody armed it.
        """
        state = self._station.state
        self._n_latches += state.mode is StationMode.LATCHED
        self._device.close()
        if not self._rearm(state):
            raise SafetyError(f"the drive ended {state.mode}: {state.reason or 'nobody armed the arm'}")
        self._take_over()
        self._device.connect()
        return True

    def _come_to_rest(self) -> bool:
        """Hold until nothing moves, for at most REST_S. Returns whether it was seen to rest."""
        for _ in range(round(REST_S / self._step_s)):
            if self._station.state.mode is not StationMode.ENGAGED:
                return False
            if self._step(Hold(grip=self._jog.grip)) is None:
                return False
            if max(map(abs, self._station.measured.qd_rad_s)) < STILL_RAD_S:
                return True
            self._pace.wait_step()
        return False

    def _show(
        self, asked: DriverInput, sent: Intent, now_ns: int, result: StepResult | None, refused: Verdict | None
    ) -> None:
        self._tell(
            DriveView(
                state=self._station.state,
                asked=asked,
                sent=sent,
                resting=self._jog.resting,
                gain=self._jog.gain,
                age_s=(now_ns - asked.stamp_ns) / 1e9,
                measured=self._station.measured,
                result=result,
                refused=refused,
                step_s=self._step_s,
                n_steps=self._n_steps,
            )
        )
