"""What the physics did about an instant: how fast, how long to rest, how far after that. On the twin's own joints."""

from pathlib import Path

import msgspec
import numpy as np

from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.motion.stopping import STOP_RAD_S2
from sim_twin.controller.trace import read_trace

__all__ = ["Judged", "Motion", "stopping_s"]

BEFORE_S = 0.03
STILL_RAD_S = 0.01
LAG_S = 0.036
"""The twin's servo behind its set-point: joints settle at this time constant."""


class Judged(msgspec.Struct, frozen=True, kw_only=True):
    """A stop, measured."""

    speed_rad_s: float
    """Of the fastest joint when it happened."""
    rest_s: float
    """From then until every joint was below 0.01 rad/s for good; infinite where that never came."""
    predicted_s: float
    after_rad: float
    """Farthest that a joint came from where it rested, until the end."""


class Motion:
    """The truth of one controller's joints.

    Args:
        path: the controller's trace.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def rows(self, since_s: float, until_s: float) -> tuple[Array, Array, Array]:
        """Return times, joints and speeds between two instants (host's monotonic).  -> (n,), (n, 6), (n, 6)"""
        rows = read_trace(self._path, since_s=since_s)
        rows = rows[rows[:, 0] <= until_s]
        return rows[:, 0], rows[:, 3:9], rows[:, 9:15]

    def moved_rad(self, since_s: float, until_s: float) -> float:
        """Return how far a joint came from where it was at first."""
        _, q, _ = self.rows(since_s, until_s)
        return float(np.abs(q - q[0]).max()) if len(q) else 0.0

    def judge(self, happened_s: float, until_s: float, *, begins_s: float) -> Judged:
        """Judge a stop. Its times are the physics' own: where physics is late or stands still, the arm is too.

        Args:
            happened_s: when something went wrong.
            until_s: how long it had to stay at rest.
            begins_s: how long after that a stop must begin.
        """
        rows = read_trace(self._path, since_s=happened_s - BEFORE_S)
        before = rows[rows[:, 0] <= happened_s]
        rows = rows[(rows[:, 0] > happened_s) & (rows[:, 0] <= until_s)]
        speed = np.abs(before[:, 9:15]).max(axis=0)
        moving = np.flatnonzero(np.abs(rows[:, 9:15]).max(axis=1) >= STILL_RAD_S)
        k = int(moving[-1]) + 1 if len(moving) else 0
        is_resting = k < len(rows)
        return Judged(
            speed_rad_s=float(speed.max()),
            rest_s=float(rows[k, 1] - before[-1, 1]) * SLICE_S if is_resting else float("inf"),
            predicted_s=begins_s + stopping_s(speed),
            after_rad=float(np.abs(rows[k:, 3:9] - rows[k, 3:9]).max()) if is_resting else float("inf"),
        )


def stopping_s(speed_rad_s: Array) -> float:
    """Return how long joints take to rest: set-points at the arm's deceleration, then what the servos trail.  (6,)"""
    fastest = float(np.abs(speed_rad_s).max())
    settle_s = LAG_S * max(0.0, float(np.log(max(fastest, STILL_RAD_S) / STILL_RAD_S)))
    return float((np.abs(speed_rad_s) / STOP_RAD_S2).max()) + settle_s
