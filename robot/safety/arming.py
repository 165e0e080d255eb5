"""From disarmed to engaged and back: who may arm, and what a latch takes to clear."""

from collections import deque
from typing import Protocol

from config.rig import PlantExpected
from robot.errors import NotEngagedError, SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode, StationState

__all__ = ["Armable", "Arming", "Operator", "TooManyLatchesError"]


class Armable(Protocol):
    """What an operator may do with a station."""

    @property
    def identity(self) -> PlantIdentity:
        """Which world would be armed."""
        ...

    @property
    def state(self) -> StationState:
        """Mode and reason."""
        ...

    def arm(self, *, by: str) -> None:
        """Go from disarmed to armed."""
        ...

    def engage(self) -> None:
        """Go from armed to engaged: targets are re-seeded from the measured state."""
        ...

    def reset_plant(self, *, seed: int, epoch: int) -> None:
        """Lay the table out while latched, so that the latch may be cleared."""
        ...

    def clear_latch(self, *, by: str) -> None:
        """Go from latched to armed, after the plant's reset only."""
        ...


class Operator(Protocol):
    """A person at the station or, where no hardware is attached, who stands in for one."""

    def arm_once(self, station: Armable) -> None:
        """Arm and engage a disarmed station. Raises SafetyError for a plant this operator may not arm."""
        ...

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: reset the plant, clear the latch, engage. Raises TooManyLatchesError when it is enough."""
        ...


class TooManyLatchesError(SafetyError):
    """The run has latched more often than it may: it fails."""


class Arming:
    """The mode of one station. Pure state: touches no plant.

    Attributes:
        n_latches: How often the station has latched since it was made.
    """

    def __init__(self, *, expected: PlantExpected, max_latches: int, latch_window: int) -> None:
        self._expected = expected
        self._max_latches, self._latch_window = max_latches, latch_window
        self._n_resets = 0
        self._latched_at = deque[int](maxlen=max_latches + 1)
        """Resets there had been at each of the newest latches."""
        self._mode = StationMode.DISARMED
        self._reason = ""
        self._is_plant_reset = False
        self.n_latches = 0

    @property
    def state(self) -> StationState:
        """Mode and, when latched, why."""
        return StationState(mode=self._mode, reason=self._reason)

    @property
    def is_engaged(self) -> bool:
        """Whether motion may be asked for."""
        return self._mode is StationMode.ENGAGED

    def arm(self, *, identity: PlantIdentity, by: str) -> None:
        """Go from disarmed to armed.

        Raises:
            SafetyError: the plant is not the one the rig names, nobody answers for it, or the mode is another.
        """
        self._require(StationMode.DISARMED, "arm")
        self._check_identity(identity)
        self._check_person(identity, by)
        self._mode = StationMode.ARMED

    def require_armed(self) -> None:
        """Raise SafetyError unless armed."""
        self._require(StationMode.ARMED, "engage")

    def engage(self) -> None:
        """Go from armed to engaged."""
        self.require_armed()
        self._mode = StationMode.ENGAGED

    def disarm(self) -> None:
        """Go back to disarmed from anything but a latch."""
        if self._mode is not StationMode.LATCHED:
            self._mode = StationMode.DISARMED

    def latch(self, reason: str) -> None:
        """Take motion away until an operator clears it. The first reason stays."""
        if self._mode is StationMode.LATCHED:
            return
        self._mode = StationMode.LATCHED
        self._reason = reason
        self._is_plant_reset = False
        self._latched_at.append(self._n_resets)
        self.n_latches += 1

    def note_plant_reset(self) -> None:
        """The plant was reset: a latch may now be cleared by an operator. Clears nothing itself."""
        self._is_plant_reset = True
        self._n_resets += 1

    def clear_latch(self, *, identity: PlantIdentity, by: str) -> None:
        """Go from latched to armed.

        Raises:
            TooManyLatchesError: it has latched too often lately.
            SafetyError: the plant was not reset since the latch, or is not the one the rig names.
        """
        self._require(StationMode.LATCHED, "clear a latch")
        n_lately = sum(self._n_resets - at < self._latch_window for at in self._latched_at)
        if n_lately > self._max_latches:
            raise TooManyLatchesError(
                f"expected at most {self._max_latches} latches in {self._latch_window} resets, came {n_lately}; "
                f"last: {self._reason}"
            )
        if not self._is_plant_reset:
            raise SafetyError(f"latched ({self._reason}): reset the plant before clearing the latch")
        self._check_identity(identity)
        self._check_person(identity, by)
        self._mode, self._reason = StationMode.ARMED, ""

    def require_engaged(self) -> None:
        """Raise NotEngagedError unless engaged."""
        if self._mode is not StationMode.ENGAGED:
            why = f" ({self._reason})" if self._reason else ""
            raise NotEngagedError(f"expected an engaged station, it is {self._mode}{why}; an operator must arm it")

    def _require(self, mode: StationMode, action: str) -> None:
        if self._mode is not mode:
            raise SafetyError(f"to {action} the station must be {mode}, it is {self._mode}")

    def _check_identity(self, identity: PlantIdentity) -> None:
        expected = self._expected
        want = (expected.kind, expected.model, expected.serial)
        came = (identity.kind.value, identity.model, identity.serial)
        if want != came:
            raise SafetyError(f"the rig names plant {'/'.join(want)}, found {'/'.join(came)}: check the rig's file")

    @staticmethod
    def _check_person(identity: PlantIdentity, by: str) -> None:
        if not by:
            raise SafetyError(f"somebody must answer for arming a {PlantKind(identity.kind).value} plant: name who")
