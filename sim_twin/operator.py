"""Who arms a station where no hardware is attached: the person who started the command, once."""

from robot.errors import SafetyError
from robot.messages import PlantKind, StationMode
from robot.safety.arming import Armable

__all__ = ["SimulatedOperator"]


class SimulatedOperator:
    """Stands in for a person at a world without hardware. Refuses a real arm."""

    name = "simulated operator"

    def arm_once(self, station: Armable) -> None:
        """Arm and engage a disarmed station.

        Raises:
            SafetyError: the plant is real.
        """
        self._refuse_real(station)
        station.arm(by=self.name)
        station.engage()

    def rearm(self, station: Armable, *, seed: int, epoch: int) -> None:
        """After a latch: lay the table out anew, then clear the latch and engage.

        Raises:
            SafetyError: the plant is real, or the station is not latched.
            TooManyLatchesError: the run has latched too often.
        """
        self._refuse_real(station)
        if station.state.mode is not StationMode.LATCHED:
            raise SafetyError(f"expected a latched station, it is {station.state.mode}: nothing to clear")
        station.reset_plant(seed=seed, epoch=epoch)
        station.clear_latch(by=self.name)
        station.engage()

    @staticmethod
    def _refuse_real(station: Armable) -> None:
        if station.identity.kind is PlantKind.REAL:
            raise SafetyError("a simulated operator may not arm a real arm: a person must, at the cell")
