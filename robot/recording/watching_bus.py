"""`autotelic session record`: joins a rig's bus as its recorder and listens until a stop is asked for. The edge."""

from collections.abc import Callable
from pathlib import Path
from time import monotonic

from config.loader import resolve
from robot.bus import TOPICS, Bus, Role
from robot.recording.errors import UnfitError
from robot.recording.listening import BusListener
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.recording.told_ticks import ToldTicks
from robot.stop_request import StopRequest

__all__ = ["record_bus"]


def record_bus(
    path: Path, *, rig: str, scenario: str, person: str, seconds: float, tell: Callable[[str], object]
) -> BusListener:
    """Record a rig's bus, and return who listened.

    Args:
        path: a file that is not there yet.
        rig: shipped rig or a file.
        scenario: the table.
        person: who attends.
        seconds: how long; 0 until Ctrl-C.
        tell: is told in words what is lost.

    Raises:
        UnfitError: the rig has no bus.
        BusError: nobody is there.
    """
    resolved = resolve(rig=rig, scenario=scenario)
    endpoint, serial = resolved.rig.bus, resolved.rig.expected.serial
    if endpoint is None:
        raise UnfitError(f"rig {resolved.rig.name}: expected a bus, it has none: `autotelic learn --record` records it")
    if not serial:
        raise UnfitError(f"rig {resolved.rig.name}: expected expected.serial, not filled in yet: topics are below it")
    with Bus(endpoint, serial=serial, role=Role.RECORDER, keys=resolved.rig.keys) as bus, StopRequest() as stop:
        recording = Recording(path, resolved, purpose=Purpose.WATCH, seed=0, person=person, tell=tell)
        try:
            topics = [topic for topic in TOPICS if topic.is_recorded]
            ticks = ToldTicks(recording.wire_ticks, is_sure=True, is_aside=recording.are_ticks_aside)
            listener = BusListener(bus, recording.recorder, topics, ticks=ticks)
            end_s = monotonic() + seconds if seconds else None
            listener.run(lambda: stop() or (end_s is not None and monotonic() >= end_s))
        finally:
            recording.close()
    return listener
