"""What a session holds of an arm's ticks, cut into pieces that a twin can be compared with. Pure."""

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from robot.messages import ArmCommand, ArmMode, ArmState

__all__ = ["PIECE_S", "Piece", "TickRow", "pieces_of", "rows_of"]

Array = NDArray[np.float64]
PIECE_S, LEAST_S = 3.0, 0.8
TOUCH_N = 8.0
"""A force on the tool that is so much off its middle is a touch: the twin alone does not know of it."""
STILL_RAD = 1e-9
MOST_MISSED = 10
"""Ticks in a row that may be missing."""
START_S, LEAST_START = 0.03, 4
STAND_S = 0.1
LEAD_S = 0.5


class TickRow(msgspec.Struct, frozen=True, kw_only=True):
    """One tick: what was measured, and what was asked for then."""

    state: ArmState
    command: ArmCommand


class Piece(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """A span of ticks without a gap, in which the arm moved freely. Arrays have a row for each tick."""

    tick_s: float
    stamp_s: float
    """Of the first tick, by the arm's clock."""
    asked_rad: Array
    """(n, 6), commanded at the tick; acts until the next."""
    lead_rad: Array
    """(m, 6), commanded before, as far as is known and matters: smoothing and delay remember them."""
    q_rad: Array
    """(n, 6), measured at the tick, before its command."""
    qd_rad_s: Array
    tcp_m: Array
    """(n, 3)"""
    tcp_quat: Array
    """(n, 4)"""
    force_n: Array
    """(n, 3)"""
    opening_m: float
    seen: NDArray[np.bool_]
    """(n,) whether the tick was measured; where it was not (a late reader) numbers lie between those beside it."""

    @property
    def n(self) -> int:
        """Ticks."""
        return len(self.q_rad)

    def head(self, seconds: float) -> "Piece":
        """Return its beginning."""
        n = min(self.n, round(seconds / self.tick_s))
        rows = ("asked_rad", "seen", "q_rad", "qd_rad_s", "tcp_m", "tcp_quat", "force_n")
        return msgspec.structs.replace(self, **{name: getattr(self, name)[:n] for name in rows})

    def start(self) -> tuple[Array, Array]:
        """Return joints and their speeds at the first tick, noise lessened by those after it.  () -> (6,), (6,)"""
        n_stand = round(STAND_S / self.tick_s)
        if self.n > n_stand and float(np.abs(np.diff(self.asked_rad[:n_stand], axis=0)).max()) < STILL_RAD:
            still = self.q_rad[:n_stand]
            if float(np.abs(still[-1] - still[0]).max()) < 1e-3:
                return still.mean(axis=0), np.zeros(6)
        n = max(LEAST_START, round(START_S / self.tick_s))
        curve = np.polynomial.polynomial.polyfit(self.tick_s * np.arange(n), self.q_rad[:n], 2)
        return curve[0], curve[1]


def rows_of(messages: Iterable[ArmState | ArmCommand | None]) -> list[list[TickRow]]:
    """Pair measurements and commands, in runs that nothing breaks.

    Args:
        messages: measurements and sent commands in their order; None where the arm was placed anew or stopped.
    """
    runs: list[list[TickRow]] = [[]]
    state: ArmState | None = None
    for message in messages:
        if message is None:
            state = None
            runs.append([])
        elif isinstance(message, ArmState):
            state = message
        elif state is not None:
            runs[-1].append(TickRow(state=state, command=message))
            state = None
    return [run for run in runs if run]


def pieces_of(rows: list[TickRow], *, tick_s: float, piece_s: float = PIECE_S) -> list[Piece]:
    """Cut a run into pieces of about so many seconds: no gap in it, nothing touched, nothing in the hand."""
    pieces: list[Piece] = []
    for run in _unbroken(rows, tick_s):
        middle_n = np.median(np.array([row.state.tcp_force_n for row in run]), axis=0)
        for free in _free(run, middle_n):
            n_pieces = max(1, round(len(free) * tick_s / piece_s))
            for part in np.array_split(np.arange(len(free)), n_pieces):
                if len(part) * tick_s >= LEAST_S:
                    lead = free[max(0, part[0] - round(LEAD_S / tick_s)) : part[0]]
                    pieces.append(_piece(free[part[0] : part[-1] + 1], lead, tick_s))
    return pieces


def _unbroken(rows: list[TickRow], tick_s: float) -> list[list[TickRow]]:
    """Cut where measurements are missing or the arm does not run."""
    runs: list[list[TickRow]] = [[]]
    for row in rows:
        before = runs[-1][-1] if runs[-1] else None
        apart_s = 0.0 if before is None else (row.state.stamp_ns - before.state.stamp_ns) * 1e-9
        is_apart = apart_s > (MOST_MISSED + 1.5) * tick_s or (before is not None and apart_s < 0.5 * tick_s)
        if row.state.mode is not ArmMode.RUNNING or is_apart:
            runs.append([])
        if row.state.mode is ArmMode.RUNNING:
            runs[-1].append(row)
    return [run for run in runs if run]


def _free(run: list[TickRow], middle_n: Array) -> list[list[TickRow]]:
    """Cut out where something is touched or held."""
    parts: list[list[TickRow]] = [[]]
    for row in run:
        off_n = float(np.abs(np.subtract(row.state.tcp_force_n, middle_n)).max())
        if off_n > TOUCH_N or row.state.grip.has_object:
            if parts[-1]:
                parts.append([])
        else:
            parts[-1].append(row)
    return [part for part in parts if part]


def _piece(rows: list[TickRow], lead: list[TickRow], tick_s: float) -> Piece:
    states = [row.state for row in rows]
    # On the arm's own grid: a command acts until the next one, whatever nobody read between them.
    stamps = np.array([state.stamp_ns for state in states]) * 1e-9
    at = np.round((stamps - stamps[0]) / tick_s).astype(int)
    grid = np.arange(at[-1] + 1)
    held = np.searchsorted(at, grid, side="right") - 1
    seen = np.zeros(len(grid), dtype=bool)
    seen[at] = True

    def even(values: Sequence[Sequence[float]]) -> Array:
        columns = np.array(values, dtype=np.float64).T
        return np.stack([np.interp(grid, at, column) for column in columns], axis=1)

    return Piece(
        tick_s=tick_s,
        stamp_s=states[0].stamp_ns * 1e-9,
        lead_rad=np.array([row.command.q_rad for row in lead]).reshape(-1, 6),
        asked_rad=np.array([row.command.q_rad for row in rows])[held],
        q_rad=even([s.q_rad for s in states]),
        qd_rad_s=even([s.qd_rad_s for s in states]),
        tcp_m=even([s.tcp_position_m for s in states]),
        tcp_quat=even([s.tcp_quat for s in states]),
        force_n=even([s.tcp_force_n for s in states]),
        seen=seen,
        opening_m=float(np.mean([s.grip.opening_m for s in states])),
    )
