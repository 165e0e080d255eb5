"""When an unattended run has to end by itself: too many stops, or no room on the disk. Pure, and state.

A UR faults at fifty protective stops of one joint within eight hours (its own counter, which nobody here can read), so
it ends long before: each stop counts for every joint.
"""

from collections import deque

import msgspec

from config.rig import Rig
from robot.bus.camera_rows import Light
from robot.bus.station_rows import StationReport
from robot.errors import RobotConfigError

__all__ = [
    "BYTES_AN_HOUR",
    "DARK_S",
    "LEAST_FREE_BYTES",
    "MOST_AN_HOUR",
    "MOST_IN_8_H",
    "LightWatch",
    "StopBudget",
    "Stopped",
    "check_night",
]

MOST_AN_HOUR, HOUR_S = 3, 3600.0
MOST_IN_8_H, SHIFT_S = 25, 8 * 3600.0
BYTES_AN_HOUR = 500_000_000
"""Of a recording on the bus, twice what was measured."""
LEAST_FREE_BYTES = 1_000_000_000
N_KEPT = 200
DARK_S = 60.0
"""So long a run waits for its light, the arm held: people step before cameras, cameras are taken anew."""


class Stopped(msgspec.Struct, frozen=True, kw_only=True):
    """One stop that latched."""

    at_s: float
    reason: str


class StopBudget:
    """Counts what latches, by what the robot node tells of itself.

    Attributes:
        stops: The newest of them, oldest first.
        n: All of them.
    """

    def __init__(self) -> None:
        self.stops: deque[Stopped] = deque(maxlen=N_KEPT)
        self.n = 0
        self._begun, self._n_told = 0, 0

    def take(self, report: StationReport, now_s: float) -> None:
        """Note what has latched since the last report; a robot node that was started anew counts from 0 again."""
        if report.begun != self._begun:
            self._begun, self._n_told = report.begun, 0
        n_new = report.n_latches - self._n_told
        if n_new <= 0:
            return
        self._n_told = report.n_latches
        told = report.latch_reasons[-n_new:]
        for reason in (*("not told",) * (n_new - len(told)), *told):
            self.n += 1
            self.stops.append(Stopped(at_s=now_s, reason=reason))

    def why_spent(self, now_s: float) -> str | None:
        """Return why the run has to end, None where it may go on."""
        for most, span_s, words in ((MOST_AN_HOUR, HOUR_S, "an hour"), (MOST_IN_8_H, SHIFT_S, "8 h")):
            n = sum(now_s - stop.at_s < span_s for stop in self.stops)
            if n > most:
                return f"expected at most {most} stops in {words}, came {n}, the last for {self.stops[-1].reason}"
        return None


class LightWatch:
    """Minds how long no picture has shown the table, by what perception tells. Without a camera it is told nothing."""

    def __init__(self) -> None:
        self._newest: Light | None = None

    def take(self, light: Light) -> None:
        """Note how it is."""
        self._newest = light

    def why_dark(self) -> str | None:
        """Return why the run has to end, None where it may go on."""
        light = self._newest
        if light is None or light.dark_s <= DARK_S:
            return None
        return (
            f"camera {light.camera}: expected pictures of a lit table, none came for {light.dark_s:.0f} s: is the "
            "light on, is the camera covered?"
        )


def check_night(rig: Rig, *, hours: float, free_bytes: int) -> None:
    """Check that a rig may be left alone so long.

    Raises:
        RobotConfigError: a real arm has no safeguard input that stops it when somebody comes, or there is no room.
    """
    if rig.expected.kind == "real" and rig.safeguard_input is None:
        raise RobotConfigError(
            f"rig {rig.name}: expected `safeguard_input`, the configurable input to which a scanner, mat or door is "
            "wired as safeguard stop, came none: an arm that nobody attends stops for whoever comes near"
        )
    needed = LEAST_FREE_BYTES + round(hours * BYTES_AN_HOUR)
    if free_bytes < needed:
        raise RobotConfigError(
            f"night: expected {needed / 1e9:.1f} GB free for {hours:g} h of recording, there are {free_bytes / 1e9:.1f}"
        )
