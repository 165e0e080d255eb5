"""The recorder node of a rig: on its bus, into a folder. Put together."""

from collections.abc import Callable
from pathlib import Path

from config.resolved import Resolved
from robot.bus import TOPICS, Bus, Role
from robot.errors import RobotConfigError
from robot.node.pulse import HealthTeller
from robot.recording.bus_recorder import BusRecorder
from robot.recording.session_files import SessionFiles
from robot.rigs import check_usable

__all__ = ["run_recorder"]


def run_recorder(
    resolved: Resolved, folder: Path, *, person: str, end: Callable[[], bool], tell: Callable[[str], object]
) -> BusRecorder:
    """Record a rig's bus until it is over, and return who did.

    Raises:
        RobotConfigError: the rig has no bus.
        BusError: nobody listens at its endpoint.
        UnfitError: the folder is no place to record to.
    """
    rig = resolved.rig
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.RECORDER, keys=rig.keys) as bus:
        files = SessionFiles(folder, resolved, person=person, tell=tell)
        recorder = BusRecorder(bus, files, [topic for topic in TOPICS if topic.is_recorded])
        health = HealthTeller(bus, recorder.pulse)
        try:
            recorder.run(end)
        finally:
            recorder.close()
            health.close()
    return recorder
