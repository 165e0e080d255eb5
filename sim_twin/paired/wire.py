"""An errand's intents through servo process, genuine client and controller, and what the physics' joints did."""

from pathlib import Path
from time import monotonic

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.resolved import Resolved
from robot.errors import RobotError
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.trace import read_trace
from sim_twin.paired.errands import Errand

__all__ = ["Sent", "Wire", "why_disturbed"]

LOST_S = 0.02
"""Where a controller's own time fell so far behind, the set-point ran ahead of the arm, which then cut its corners."""
LATE_STEP_S, LATE_S = 0.02, 0.05
"""Where a servo process lost so much time, in one time step or in all, the arm caught up with a set-point that stood
still: fuller corners."""


class Sent(msgspec.Struct, frozen=True, kw_only=True):
    """What became of an errand."""

    t_s: NDArray[np.floating]  # (n,)
    """The controller's time."""
    q_rad: NDArray[np.floating]  # (n, 6)
    """Joints of the physics."""
    disturbed: str | None
    """What kept the errand from its end or from its time, in words; None where nothing did."""


class Wire:
    """A station of the rig virtual_lab, made and armed with the first errand.

    Args:
        wired: The rig; its controller runs.
        trace: The file in which that controller leaves the physics' joints.
    """

    def __init__(self, wired: Resolved, trace: Path) -> None:
        self._wired, self._trace = wired, trace
        self._station: OperatedStation | None = None

    def release(self) -> None:
        """Let go of the arm; the next errand takes it again. Idempotent."""
        station, self._station = self._station, None
        if station is not None:
            station.close()

    def send(self, errand: Errand) -> Sent:
        """Lay the table out as for the errand and send its intents, one a time step."""
        times_s = [monotonic()]
        try:
            station = self._take()
            station.reset(seed=errand.seed, epoch=errand.epoch)
            times_s = [monotonic()]
            cut_short = self._send_intents(station, errand, times_s)
        except RobotError as error:
            self.release()
            cut_short = f"{type(error).__name__}: {error}"
        rows = read_trace(self._trace, since_s=times_s[0])
        rows = rows[rows[:, 0] <= times_s[-1]]
        disturbed = cut_short or why_disturbed(
            times_s=times_s,
            stamps_s=rows[:, 0],
            slices=rows[:, 1],
            step_s=self._wired.arm.motion.step_s,
        )
        return Sent(t_s=SLICE_S * rows[:, 1], q_rad=rows[:, 3:9], disturbed=disturbed)

    def _take(self) -> OperatedStation:
        if self._station is None:
            self._station = OperatedStation(build_station(self._wired), build_operator(self._wired.rig))
            self._station.connect()
        return self._station

    def _send_intents(self, station: OperatedStation, errand: Errand, times_s: list[float]) -> str | None:
        """Send them, note when each time step ended, and return in words what cut the errand short, if anything."""
        for intent in errand.intents:
            result = station.step(intent)
            if result.is_void:
                return "; ".join(f"{one.reason}: {one.detail}" for one in result.verdicts) or "an object lost"
            times_s.append(monotonic())
        return None


def why_disturbed(
    *,
    times_s: list[float],
    stamps_s: NDArray[np.floating],
    slices: NDArray[np.floating],
    step_s: float,
) -> str | None:
    """Return in words what of the machine's doing bent a path, None where nothing did.

    Args:
        times_s: The host's time at the beginning, and at the end of each time step.
        stamps_s: The host's time of each slice of the controller meanwhile.  (n,)
        slices: The slices' numbers.  (n,)
        step_s: How long a time step should last.
    """
    longest_s = float(np.diff(times_s).max())
    if longest_s > step_s + LATE_STEP_S:
        return f"a time step of {1e3 * longest_s:.0f} ms"
    spent_s = float(np.ptp(slices)) * SLICE_S
    lost_s = float(np.ptp(stamps_s)) - spent_s
    if lost_s > LOST_S:
        return f"{1e3 * lost_s:.0f} ms of the controller's time lost"
    late_s = spent_s - (len(times_s) - 1) * step_s
    if late_s > LATE_S:
        return f"{1e3 * late_s:.0f} ms of the servo process's time lost"
    return None
