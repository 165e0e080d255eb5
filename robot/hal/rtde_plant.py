"""A UR5e as a plant: the arm at the rig's address."""

from collections.abc import Callable, Mapping

from config.arm import ArmConfig
from config.cell import CellConfig
from config.rig import Rig
from config.scenario import Scenario
from robot.errors import RobotConfigError
from robot.hal.pins import Pins
from robot.hal.protocols import Camera, Resetter, SceneTruth
from robot.hal.rtde import RtdeArm
from robot.hal.rtde_clock import TICK_NS
from robot.hal.ur_observer import UrObserver
from robot.hal.ur_state import kind_of_address
from robot.messages import PlantIdentity

__all__ = ["RtdePlant"]


class _NoResetter:
    """A robot lays no table out: whoever does is reached by other ways, on the bus or in person."""

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Refuse.

        Raises:
            RobotConfigError: always.
        """
        raise RobotConfigError(
            f"reset (seed {seed}, epoch {epoch}, outputs {digital_out:b}): expected somebody who lays the table out, "
            "the arm's controller cannot; give the rig a bus with a twin on it"
        )


class RtdePlant:
    """A UR5e at an address: real, or a virtual controller on this machine's loopback."""

    def __init__(self, *, arm: ArmConfig, scenario: Scenario, rig: Rig, cell: CellConfig | None = None) -> None:
        """Store. Nothing is acquired.

        Raises:
            RobotConfigError: the rig names no address, or its ticks are not the arm's.
        """
        if rig.address is None:
            raise RobotConfigError(f"rig {rig.name}: expected an address for its arm, came none")
        if round(rig.tick_s * 1e9) != TICK_NS:
            raise RobotConfigError(f"rig {rig.name}: expected tick_s 0.002, as the arm's, came {rig.tick_s}")
        self._kind, self._scenario = kind_of_address(rig.address), scenario
        self._config, self._address, self._serial, self._cell = arm, rig.address, rig.expected.serial, cell
        self.arm = RtdeArm(arm=arm, address=rig.address, serial=rig.expected.serial, cell=cell)
        self.cameras: Mapping[str, Camera] = {}
        self.truth: SceneTruth | None = None
        self.resetter: Resetter = _NoResetter()

    def end_by(self, end: Callable[[], object]) -> None:
        """Have this process ended by this, once the link is lost where nobody ticks."""
        self.arm.links.when_lost = end

    def abandon(self) -> None:
        """Stop the fingers, before this process ends."""
        self.arm.abandon()

    def tell_upload(self, tell: Callable[[], object]) -> None:
        """Have this called before a program is uploaded."""
        self.arm.links.when_uploading = tell

    def heed(self, is_stopped: Callable[[], bool]) -> None:
        """Have this asked all the while command is taken and a hand activated."""
        self.arm.is_stopped = is_stopped

    def observer(self) -> UrObserver:
        """Return somebody who looks at the arm by clients that cannot move it."""
        return UrObserver(arm=self._config, address=self._address, serial=self._serial, pins=Pins(self._cell))

    @property
    def identity(self) -> PlantIdentity:
        """What the controller says it is, from connect() on; before that its serial is empty."""
        return PlantIdentity(kind=self._kind, model=self.arm.spec.model, serial=self.arm.serial)
