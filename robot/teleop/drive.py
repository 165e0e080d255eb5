"""One drive from its options to its end: what is made, in which order, and how it is all given back. The edge."""

import signal
from contextlib import ExitStack
from pathlib import Path
from time import monotonic_ns
from typing import Protocol

import msgspec
import typer
from rich.console import Console

from config.loader import resolve
from config.resolved import Resolved
from robot.errors import RobotConfigError, RobotError
from robot.local_station import LocalStation
from robot.messages import StationMode, StationState
from robot.operated import AskingOperator, operator_of
from robot.person import PersonOperator, TerminalPerson
from robot.recording.messages import Purpose
from robot.recording.recording import UNNAMED, Recording
from robot.recording.taps import RecordedDrive
from robot.rigs import build_shadow, build_view, find_station
from robot.safety import Armable, Operator
from robot.stop_request import StopRequest
from robot.teleop.device import open_device
from robot.teleop.driver import DriveEnd, DrivenStation, Driver, DriveView, Pace, Unpaced
from robot.teleop.episodes import Episodes
from robot.teleop.jog import Jog, JogLimits
from robot.teleop.pace import WallPace
from robot.teleop.preview import AheadPreview
from robot.teleop.readout import ReadOut
from robot.teleop.view import View
from robot.tick_ring import ticks_of

__all__ = ["DriveOptions", "Rearm", "run_drive"]

STEP_S = 0.02
FULL_M_S, FULL_RAD_S = 0.25, 0.8
"""Hand-guided speed: ISO 10218's reduced speed is 250 mm/s."""
RAMP_S = 0.25
AHEAD_S = 0.2
"""How far a preview is ahead of the arm: longer than it takes to come to rest from full speed."""
END_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, a polite kill, and a terminal or an SSH connection that went away; only Ctrl-C twice ends at once."""
LEASE_NS = 1_000_000_000
"""A drive loop that did not come round for so long is gone: the arm is disarmed."""


class DrivenArm(DrivenStation, Armable, Protocol):
    """A driven station that an operator can arm."""


class DriveOptions(msgspec.Struct, frozen=True, kw_only=True):
    """What a driver asked for on the command line."""

    rig: str
    scenario: str
    device: str
    speed: float
    seed: int
    view: bool
    preview: bool
    fast: bool
    json: bool
    record_to: Path | None = None
    """Where the drive is recorded, None where it is not."""
    person: str = UNNAMED

    @property
    def is_script(self) -> bool:
        """Whether nobody is there: a file drives."""
        return self.device.startswith("script")


def run_drive(options: DriveOptions) -> None:
    """Drive until the driver is done; the arm is at rest then and the terminal as it was.

    Raises:
        ConfigError: a file does not parse or fit.
        RobotError: the device or the plant is not there, or it latched and nobody armed it again.
    """
    resolved = resolve(rig=options.rig, scenario=options.scenario)
    pace = _pace(resolved, options)
    device = open_device(options.device, now_ns=pace.now_ns, step_s=STEP_S)
    console = Console(stderr=True)
    with ExitStack() as stack:
        end = stack.enter_context(StopRequest(signals=END_SIGNALS, at_once=(signal.SIGINT,)))
        recording = _open_recording(resolved, options, stack)
        tap = None if recording is None else recording.ticks
        station = stack.enter_context(find_station(resolved, is_driven=True, tap=tap))
        driven: DrivenStation = station if recording is None else recording.drive(station, ticks=ticks_of(station))
        station.take_lease(f"teleop by {device.name}", life_ns=None if options.is_script else LEASE_NS)
        marks = driven if isinstance(driven, RecordedDrive) else None
        episodes = Episodes(driven, marks=marks, seed=options.seed, lays_out=resolved.rig.reset == "twin")
        _arm(station, resolved)
        episodes.begin()
        stack.callback(episodes.quit)
        view = _open_view(resolved, console, stack) if options.view else None
        readout = ReadOut(keys=device.keys, console=console, now_ns=monotonic_ns)
        stack.enter_context(readout)
        rearm = Rearm(station, readout, is_person=not options.is_script, seed=options.seed)
        driver = Driver(
            station=driven,
            device=device,
            jog=Jog(_limits(resolved, options.speed)),
            pace=pace,
            step_s=STEP_S,
            rearm=lambda state: episodes.void(lambda: rearm(state)),
            tell=_Shown(readout, view, station),
            should_stop=end,
            preview=_open_preview(resolved, stack) if options.preview else None,
            end_episode=episodes.end,
        )
        ended = driver.run()
    _tell(ended, as_json=options.json)


class _Shown:
    """Shows every step in the terminal and, where there is one, in the live view."""

    def __init__(self, readout: ReadOut, view: View | None, station: DrivenArm) -> None:
        self._readout, self._view, self._station = readout, view, station

    def __call__(self, view: DriveView) -> None:
        self._readout(view)
        if self._view is not None:
            self._view.show(view.measured, self._station.percept)


def _open_view(resolved: Resolved, console: Console, stack: ExitStack) -> View | None:
    """Open the rig's live view. Where it cannot be shown the drive goes on without."""
    view = build_view(resolved)
    if view is None:
        return None
    stack.callback(view.close)
    try:
        console.print(f"live view: {view.open()}", highlight=False)
    except RobotError as error:
        console.print(f"no live view: {error}", highlight=False, markup=False)
        return None
    return view


def _open_preview(resolved: Resolved, stack: ExitStack) -> AheadPreview:
    if resolved.rig.perception is None:
        raise RobotConfigError(f"--preview: expected a rig that perceives its table, {resolved.rig.name} does not")
    shadow = build_shadow(resolved)
    stack.callback(shadow.close)
    return AheadPreview(shadow, n_ahead=round(AHEAD_S / STEP_S), step_s=STEP_S)


class Rearm:
    """Asks whoever sits at the terminal; each time it lays another table out, where a twin does that."""

    def __init__(self, station: DrivenArm, readout: ReadOut, *, is_person: bool, seed: int) -> None:
        self._station, self._readout, self._seed = station, readout, seed
        self._is_person = is_person
        self._n_resets = 0

    def __call__(self, state: StationState) -> bool:
        """Return whether somebody armed it again. Raises SafetyError where the answer is wrong or late."""
        if not self._is_person:
            return False
        self._readout.pause()
        operator = self._operator(state)
        if state.mode is StationMode.LATCHED:
            self._n_resets += 1
            operator.rearm(self._station, seed=self._seed, epoch=self._n_resets)
        else:
            operator.arm_once(self._station)
        self._readout.go_on()
        return True

    def _operator(self, state: StationState) -> Operator:
        """Return who arms it: whoever sits here, or who holds the arm elsewhere, once somebody here has looked."""
        if isinstance(self._station, LocalStation):
            return PersonOperator(TerminalPerson())
        TerminalPerson().await_key(f"the arm was stopped ({state.reason}): find out why, and see to it")
        return AskingOperator()


def _open_recording(resolved: Resolved, options: DriveOptions, stack: ExitStack) -> Recording | None:
    """Begin to record, where that is wanted; it is finished after the arm was given back."""
    if options.record_to is None:
        return None
    recording = Recording(
        options.record_to, resolved, purpose=Purpose.DRIVE, seed=options.seed, person=options.person,
        about={"device": options.device.partition(":")[0]},
        tell=lambda why: typer.echo(f"recording: {why}", err=True),
    )  # fmt: skip
    stack.callback(recording.close)
    return recording


def _arm(station: DrivenArm, resolved: Resolved) -> None:
    """Let the rig's operator arm the station."""
    operator = operator_of(station, resolved.rig) or PersonOperator()
    operator.arm_once(station)


def _limits(resolved: Resolved, speed: float) -> JogLimits:
    """Return how a driver drives: never faster than by hand-guided speed, the arm's own, or the profile's."""
    motion = resolved.arm.motion
    return JogLimits(
        full_m_s=speed * min(FULL_M_S, motion.speed_m_s, resolved.profile.speeds.tcp_m_s),
        full_rad_s=speed * FULL_RAD_S,
        ramp_s=RAMP_S,
        deadline_s=motion.intent_max_age_s,
        step_s=STEP_S,
    )


def _pace(resolved: Resolved, options: DriveOptions) -> Pace:
    """Return the driver's time: steps of a plant on a wire take theirs, a twin's are paced here."""
    is_wired = resolved.rig.bus is not None
    if options.fast and (is_wired or not options.is_script):
        raise RobotConfigError("--fast: expected a rig in lock-step and a script, for anybody else drives in real time")
    if is_wired:
        return Unpaced(step_s=STEP_S, now_ns=monotonic_ns)
    return Unpaced(step_s=STEP_S) if options.fast else WallPace(step_s=STEP_S)


def _tell(ended: DriveEnd, *, as_json: bool) -> None:
    if as_json:
        typer.echo(msgspec.json.encode(ended).decode())
        return
    limited = ", ".join(f"{name} {n}" for name, n in sorted(ended.limited.items())) or "none"
    rest = "at rest" if ended.is_at_rest else "not seen to rest: the station stopped it"
    typer.echo(f"drove {ended.n_steps} steps of {STEP_S:g} s; the arm is {rest}; limiters: {limited}")
