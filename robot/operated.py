"""A station with its operator: armed once at the start, armed again at the reset after a latch."""

from types import TracebackType
from typing import Protocol

from robot.errors import NotEngagedError, WireError
from robot.messages import Intent, Percept, StationMode, StationSpec, StationState, StepResult
from robot.safety import Armable, Operator
from robot.station import Station

__all__ = ["OperatedStation"]


class _ArmableStation(Station, Armable, Protocol):
    """A station that an operator can arm."""


class OperatedStation:
    """Implements robot.station.Station for long unattended runs where no hardware is attached.

    Attributes:
        n_resets: How often the table was laid out for an epoch.
    """

    def __init__(self, station: _ArmableStation, operator: Operator | None) -> None:
        """Store both.

        Args:
            station: what to operate.
            operator: who arms it; None where a person must, before and during the run.
        """
        self._station = station
        self._operator = operator
        self.n_resets = 0

    def connect(self) -> None:
        """Arm the station, if there is an operator and it is not armed yet."""
        if self._operator is not None and self._station.state.mode is StationMode.DISARMED:
            self._operator.arm_once(self._station)

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

        So too where the arm is lost while the table is laid out: that is no other loss than one in an epoch.

        Raises:
            NotEngagedError: nobody has armed the station, or it is latched and there is no operator.
            WireError: the plant cannot be laid out.
            TooManyLatchesError: it has latched more often than it may.
        """
        while True:
            try:
                if self._operator is not None and self._station.state.mode is StationMode.LATCHED:
                    self._operator.rearm(self._station, seed=seed, epoch=epoch)
                percept = self._station.reset(seed=seed, epoch=epoch)
            except (NotEngagedError, WireError):
                if self._operator is None or self._station.state.mode is not StationMode.LATCHED:
                    raise
            else:
                self.n_resets += 1
                return percept

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
