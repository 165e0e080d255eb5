"""A box's place from its edges: they are moved over the picture until grey changes across most of them.

Colour would not do: a box may be of the table's own. What a shadow draws beside one edge it does not draw beside all.
"""

import msgspec
import numpy as np
from numpy.typing import NDArray

from perception.calibration.lens import Array
from perception.detection.colours import GREY_WEIGHTS
from perception.detection.eye import Eye
from perception.detection.matching import best_place, edge_rows
from perception.detection.solids import Edges
from perception.opencv import opencv

__all__ = ["EdgeFit", "Smooth", "fit_edges", "fit_edges_near", "smooth"]

REACH_M = 0.036
COARSE_M, FINE_M = 0.004, 0.001
N_FINE, EVERY = 4, 3
"""Fine steps to either side; the coarse search takes every third point."""
N_STEADY = 2
"""Fine steps about where a box was in the picture before."""
SMOOTH_PX = 1.0
LEAST_POINTS = 24


class Smooth(msgspec.Struct, frozen=True, kw_only=True):
    """A part of a picture in grey without its noise, in the table's brightness."""

    grey: NDArray[np.float32]
    origin: Array


class EdgeFit(msgspec.Struct, frozen=True, kw_only=True):
    """Where edges fit best."""

    position_m: tuple[float, float]
    support: float
    """Mean over the edges' points of how surely grey changes across them, 0 to 1."""


def smooth(rgb: NDArray[np.uint8], origin: Array, white: float) -> Smooth:
    """Return a part of a picture whose grey rises where edges are, and little elsewhere.  (h, w, 3) -> (h, w)"""
    cv2 = opencv()
    grey = cv2.transform(rgb.astype(np.float32), (GREY_WEIGHTS / white).astype(np.float32)[None, :])
    return Smooth(grey=cv2.GaussianBlur(grey, (0, 0), SMOOTH_PX), origin=origin)


def fit_edges(eye: Eye, edges: Edges, start_m: Array, field: Smooth, *, reach_m: float = REACH_M) -> EdgeFit | None:
    """Return where a box's edges fit best within a reach of where it may be; None where too few are in the picture."""
    coarse = _search(eye, edges, start_m, field, COARSE_M, int(np.ceil(reach_m / COARSE_M)), EVERY)
    return None if coarse is None else fit_edges_near(eye, edges, coarse[0], field, n=N_FINE)


def fit_edges_near(eye: Eye, edges: Edges, start_m: Array, field: Smooth, *, n: int = N_STEADY) -> EdgeFit | None:
    """Return the same within a few millimetres of where it was, or is nearly known to be."""
    near = _search(eye, edges, start_m, field, FINE_M, n)
    last = None if near is None else _search(eye, edges, near[0], field, FINE_M / 2, 1)
    if last is None:
        return None
    x, y = last[0][:2].tolist()
    return EdgeFit(position_m=(x, y), support=last[1])


def _search(
    eye: Eye, edges: Edges, start_m: Array, field: Smooth, step_m: float, n: int, every: int = 1
) -> tuple[Array, float] | None:
    """Return the best of (2 n + 1)² places, brought between grid points by a parabola each way, and its support."""
    height, width = field.grey.shape
    x, y, z = start_m.tolist()
    u, v = field.origin.tolist()
    table = edge_rows(eye.numbers, eye.T_cb, edges.points_m, edges.ahead_m, (x, y, z), (u, v), (width, height), every)
    if len(table) * every < LEAST_POINTS:
        return None
    i, j, peak, before_x, after_x, before_y, after_y = best_place(field.grey, table, step_m, n)
    x += step_m * (i + _vertex(before_x, peak, after_x))
    y += step_m * (j + _vertex(before_y, peak, after_y))
    return np.array([x, y, z]), peak


def _vertex(before: float, peak: float, after: float) -> float:
    """Return where a parabola through a peak and its neighbours has its top, in steps from it."""
    bend = before - 2.0 * peak + after
    return min(max(0.5 * (before - after) / bend, -0.5), 0.5) if bend < 0.0 else 0.0
