"""The hub of a rig's bus, where no other process is it: the others find one another through it. The edge."""

from collections.abc import Callable
from time import sleep

from config.rig import Rig
from robot.bus import Bus, Role
from robot.errors import RobotConfigError
from robot.node.pulse import HealthTeller, Pulse
from robot.rigs import check_usable

__all__ = ["SOURCE", "run_hub"]

SOURCE = "hub"
LOOK_S = 0.1


def run_hub(rig: Rig, *, end: Callable[[], bool]) -> None:
    """Be the hub of a rig's bus until it is over.

    Raises:
        RobotConfigError: the rig has no bus.
        BusError: its endpoint is taken.
    """
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.VIEWER, source=SOURCE, is_hub=True, keys=rig.keys) as bus:
        pulse = Pulse(target_hz=1.0 / LOOK_S)
        pulse.doing = "passes on"
        health = HealthTeller(bus, pulse)
        try:
            while not end():
                pulse.beat()
                sleep(LOOK_S)
        finally:
            health.close()
