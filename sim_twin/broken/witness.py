"""A second client of the controller, which only reads: what a fault made of the wire, for whoever judges it."""

from pathlib import Path
from time import monotonic, sleep
from types import TracebackType
from typing import Self

import msgspec
import numpy as np
from rtde_receive import RTDEReceiveInterface

from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.trace import read_trace

__all__ = ["Seen", "Witness"]

RATE_HZ, LOOK_S = 125.0, 0.001
FIELDS = ("timestamp", "actual_q", "actual_TCP_force", "payload")
TRACED_S = 0.3
"""How long before a look the truth is kept at hand: what comes late is of before."""


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """What the wire told for a while, beside the physics' own. Arrays over n states of it."""

    lag_s: Array
    """From the instant at which the physics was there until a state of it was here.  (n,)"""
    q_off_rad: Array
    """Joints as told less the physics' own in the same slice.  (n, 6)"""
    force_n: Array
    """On the tool as told, base axes.  (n, 3)"""
    payload_kg: Array
    """As told.  (n,)"""
    period_s: Array
    """From slice to slice of the controller, by the host's time.  (m,)"""


class Witness:
    """An RTDE client beside the backend's.

    Args:
        host: the controller's address.
        trace: the controller's own record of its physics.
    """

    def __init__(self, host: str, trace: Path) -> None:
        self._host, self._trace = host, trace
        self._receive: RTDEReceiveInterface | None = None

    def __enter__(self) -> Self:
        """Connect, which stops the other threads of this process for a moment."""
        self._receive = RTDEReceiveInterface(self._host, RATE_HZ, list(FIELDS))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._receive = None

    def look(self, seconds: float) -> Seen:
        """Take in what is told for a while, each state once."""
        assert self._receive is not None, "it was entered"
        receive, begun_s, rows, last = self._receive, monotonic(), [], -1.0
        while (now_s := monotonic()) < begun_s + seconds:
            stamp = receive.getTimestamp()
            told = (*receive.getActualQ(), *receive.getActualTCPForce()[:3], receive.getPayload())
            if stamp != last and stamp == receive.getTimestamp():  # all of one state
                rows.append((now_s, stamp, *told))
                last = stamp
            sleep(LOOK_S)
        truth = read_trace(self._trace, since_s=begun_s - TRACED_S)
        period_s = np.diff(truth[truth[:, 0] > begun_s, 0])
        return _beside_truth(np.array(rows).reshape(-1, 12), truth, period_s)


def _beside_truth(rows: Array, truth: Array, period_s: Array) -> Seen:
    """Put what was told beside the physics of the same slices.  (n, 12), (m, 15), (k,)"""
    slices = np.rint(rows[:, 1] / SLICE_S)
    rows, slices = rows[np.isin(slices, truth[:, 1])], slices[np.isin(slices, truth[:, 1])]
    truth = truth[np.searchsorted(truth[:, 1], slices)]
    return Seen(
        lag_s=rows[:, 0] - truth[:, 0],
        q_off_rad=rows[:, 2:8] - truth[:, 3:9],
        force_n=rows[:, 8:11],
        payload_kg=rows[:, 11],
        period_s=period_s,
    )
