"""Where touched boards lie, and whether the touches can be believed. Pure sums."""

import numpy as np

from perception.calibration.board import Board, corner_points
from perception.calibration.evidence import Placement
from perception.calibration.faults import Fault, Reason
from perception.calibration.lens import Array
from perception.calibration.poses import carried, rigid_fit

__all__ = ["LEAST_TOUCHES", "Lying", "check_touches", "lay"]

LEAST_TOUCHES = 4
LEAST_WIDTH_M = 0.03
"""Rms spread of the touched corners across their line: on a line they leave the board free to turn about it."""
MOST_TOUCH_RMS_MM = 1.5
SCALE_TOLERANCE = 0.01
"""Touches 1 mm wrong on a board of 0.25 m stretch it by 0.4 %; a page shrunk to fit is 3 to 6 % smaller."""


class Lying:
    """A board where its touches say that it lies.

    Attributes:
        T_bo: The board in the base frame.
        rms_mm: How far the touches are from it.
        scale: By what the board's lengths would have to be multiplied to agree with the touches'.
    """

    def __init__(self, T_bo: Array, rms_mm: float, scale: float) -> None:
        self.T_bo, self.rms_mm, self.scale = T_bo, rms_mm, scale


def lay(board: Board, placement: Placement) -> Lying:
    """Return where a touched board lies, in least squares."""
    touched = np.array([touch.position_m for touch in placement.touches])
    corners = corner_points(board)[[touch.corner for touch in placement.touches]]
    T_bo, scale = rigid_fit(corners, touched)
    miss = carried(T_bo, corners) - touched
    return Lying(T_bo, 1e3 * float(np.sqrt((miss**2).sum(axis=1).mean())), scale)


def check_touches(board: Board, placement: Placement, name: str) -> list[Fault]:
    """Return what is wrong with one board's touches: number, spread, agreement, and the distances between them."""
    n_corners = (board.n_columns - 1) * (board.n_rows - 1)
    numbers = [touch.corner for touch in placement.touches]
    strange = [n for n in numbers if n >= n_corners]
    if strange:
        detail = f"{name}: expected corners 0 to {n_corners - 1}, came {', '.join(map(str, strange))}"
        return [Fault(reason=Reason.TOUCHES, detail=detail)]
    if len(set(numbers)) < LEAST_TOUCHES or _width_m(corner_points(board)[numbers]) < LEAST_WIDTH_M:
        detail = (
            f"{name}: expected {LEAST_TOUCHES} touched corners or more, not on one line, came "
            f"{', '.join(map(str, sorted(set(numbers))))}: take those at the board's four ends"
        )
        return [Fault(reason=Reason.TOUCHES, detail=detail)]
    lying = lay(board, placement)
    if abs(lying.scale - 1.0) > SCALE_TOLERANCE:
        detail = (
            f"{name}: the touched corners are {100 * (lying.scale - 1.0):+.1f} % apart from what the board's file "
            f"says: its squares measure {1e3 * board.square_m * lying.scale:.2f} mm, not {1e3 * board.square_m:g}"
        )
        return [Fault(reason=Reason.SQUARE_SIZE, detail=detail)]
    if lying.rms_mm > MOST_TOUCH_RMS_MM:
        detail = (
            f"{name}: expected touches within {MOST_TOUCH_RMS_MM:g} mm of a flat board rms, came {lying.rms_mm:.1f}: "
            "is a corner's number wrong, does the board lie flat, is the tool's tip where the tool centre point is?"
        )
        return [Fault(reason=Reason.TOUCHES, detail=detail)]
    return []


def _width_m(points: Array) -> float:
    return float(np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(points)))
