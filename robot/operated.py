"""A station with its operator: armed once at the start, armed again at the reset after a latch.

An arm may stop at any moment, also while its table is laid out and command is taken for the next epoch. That is a latch
like any other: the operator arms again, as often as the latch limit allows, and the reset is done once more. A wire
that fails while the station is latched counts as no latch; it is tried five times. So it is where the station was
disarmed meanwhile, because its lease ended or the process that holds it was started anew.
"""

from collections.abc import Callable
from time import sleep
from types import TracebackType
from typing import Protocol

from config.rig import Rig
from robot.errors import NotEngagedError, RobotConfigError, RobotError, WireError
from robot.local_station import LocalStation
from robot.messages import Intent, Percept, StationMode, StationSpec, StationState, StepResult
from robot.person import PersonOperator
from robot.rigs import build_operator
from robot.safety import Armable, Operator, TooManyLatchesError
from robot.station import Station

__all__ = ["AskingOperator", "OperatedStation", "operator_of"]

MOST_FAILED, PAUSE_S = 5, 1.0
"""So often in a row a wire may fail while nothing is engaged that could latch; so long is waited before each try."""


class _ArmableStation(Station, Armable, Protocol):
    """A station that an operator can arm."""

    @property
    def n_latches(self) -> int:
        """How often it has latched."""
        ...


class AskingOperator:
    """Implements Operator by asking whoever holds the arm: there a person is asked in turn, and here nobody is."""

    name = "whoever has the lease"

    def arm_once(self, station: Armable) -> None:
        """Ask for a disarmed station to be armed, and engage it."""
        station.arm(by=self.name)
        station.engage()

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: ask for the table to be laid out anew and for the latch to be cleared, and engage.

        Raises:
            TooManyLatchesError: the run has latched too often.
        """
        station.reset_plant(seed=seed, epoch=epoch)
        station.clear_latch(by=self.name)
        station.engage()


def operator_of(station: Armable, rig: Rig) -> Operator | None:
    """Return who arms a station: the rig's operator, asked where the arm is held if that is another process."""
    operator = build_operator(rig)
    is_elsewhere = isinstance(operator, PersonOperator) and not isinstance(station, LocalStation)
    return AskingOperator() if is_elsewhere else operator


class OperatedStation:
    """Implements robot.station.Station for long unattended runs where no hardware is attached.

    Attributes:
        n_resets: How often the table was laid out for an epoch.
    """

    def __init__(
        self, station: _ArmableStation, operator: Operator | None, *, pause: Callable[[float], object] = sleep
    ) -> None:
        """Store.

        Args:
            station: what to operate.
            operator: who arms it; None where a person must, before and during the run.
            pause: waits for so many seconds.
        """
        self._station = station
        self._operator = operator
        self.n_resets = 0
        self._pause = pause

    def connect(self) -> None:
        """Arm the station, if there is an operator and it is not armed yet.

        An arm that stops meanwhile has latched: the first reset arms it again, as after any other stop, and as where
        the lease ended while a person at the arm was waited for.

        Raises:
            RobotError: the operator refuses, the arm cannot be reached, or a file is wrong.
        """
        if self._operator is None or self._station.state.mode is not StationMode.DISARMED:
            return
        try:
            self._operator.arm_once(self._station)
        except RobotConfigError:
            raise
        except RobotError as error:
            if not isinstance(error, NotEngagedError) and self._station.state.mode is not StationMode.LATCHED:
                raise

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        return self._station.spec

    @property
    def state(self) -> StationState:
        """Mode and, when latched, why."""
        return self._station.state

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch; after a latch the operator first resets the plant and arms again.

        One that was disarmed is armed again by the operator too.

        Where the arm is lost on the way, or a wire fails, it is done once more.

        Raises:
            NotEngagedError: nobody has armed the station, or it is latched and there is no operator.
            WireError: the plant cannot be laid out.
            TooManyLatchesError: it has latched more often than it may.
            RobotError: the operator refuses, or a wire failed five times in a row while nothing was engaged.
        """
        n_failed = 0
        while True:
            n_latches = self._station.n_latches
            try:
                percept = self._reset(seed=seed, epoch=epoch)
            except (RobotConfigError, TooManyLatchesError):
                raise
            except RobotError as error:
                is_down = self._station.state.mode in (StationMode.LATCHED, StationMode.DISARMED)
                is_new = self._station.n_latches > n_latches
                n_failed = 0 if is_new else n_failed + 1
                is_borne = is_new or (isinstance(error, WireError | NotEngagedError) and n_failed < MOST_FAILED)
                if self._operator is None or not is_down or not is_borne:
                    raise
            else:
                self.n_resets += 1
                return percept
            self._pause(PAUSE_S)

    def _reset(self, *, seed: int, epoch: int) -> Percept:
        mode = self._station.state.mode
        if self._operator is not None and mode is StationMode.LATCHED:
            self._operator.rearm(self._station, seed=seed, epoch=epoch)
        elif self._operator is not None and mode is StationMode.DISARMED:
            self._operator.arm_once(self._station)
        return self._station.reset(seed=seed, epoch=epoch)

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent for one time step."""
        return self._station.step(intent, duration_s=duration_s)

    def close(self) -> None:
        """Stop and release. Idempotent."""
        self._station.close()

    def __enter__(self) -> "OperatedStation":
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
