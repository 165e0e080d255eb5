"""A box's place from its edges: they are moved over the picture until grey changes across most of them.

Colour would not do: a box may be of the table's own. What a shadow draws beside one edge it does not draw beside all.
"""

import msgspec
import numpy as np

from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.matching import best_place
from perception.detection.solids import Edges
from perception.opencv import opencv

__all__ = ["EdgeFit", "Slopes", "fit_edges", "slopes"]

REACH_M = 0.036
COARSE_M, FINE_M = 0.004, 0.001
N_FINE, EVERY = 4, 3
"""Fine steps to either side; the coarse search takes every third point."""
SMOOTH_PX = 1.0
LEAST_POINTS = 24
STEP_M = 1e-3


class Slopes(msgspec.Struct, frozen=True, kw_only=True):
    """How grey rises to the right and down in a part of a picture, in the table's brightness a pixel."""

    right: Array
    down: Array
    origin: Array


class EdgeFit(msgspec.Struct, frozen=True, kw_only=True):
    """Where edges fit best."""

    position_m: tuple[float, float]
    support: float
    """Mean over the edges' points of how surely grey changes across them, 0 to 1."""


def slopes(grey: Array, origin: Array, white: float) -> Slopes:
    """Return grey's slopes.  (h, w) -> 2 x (h, w)"""
    cv2 = opencv()
    smooth = cv2.GaussianBlur(grey.astype(np.float64), (0, 0), SMOOTH_PX) / white
    half = np.array([-0.5, 0.0, 0.5])
    one = np.array([1.0])
    return Slopes(
        right=cv2.sepFilter2D(smooth, -1, half, one), down=cv2.sepFilter2D(smooth, -1, one, half), origin=origin
    )


def fit_edges(eye: Eye, edges: Edges, start_m: Array, field: Slopes, *, reach_m: float = REACH_M) -> EdgeFit | None:
    """Return where a box's edges fit best within a reach of where it may be; None where too few are in the picture."""
    coarse = _search(eye, edges, start_m, field, COARSE_M, int(np.ceil(reach_m / COARSE_M)), EVERY)
    if coarse is None:
        return None
    near = _search(eye, edges, coarse[0], field, FINE_M, N_FINE)
    last = None if near is None else _search(eye, edges, near[0], field, FINE_M / 2, 1)
    if last is None:
        return None
    x, y = last[0][:2].tolist()
    return EdgeFit(position_m=(x, y), support=last[1])


def _search(
    eye: Eye, edges: Edges, start_m: Array, field: Slopes, step_m: float, n: int, every: int = 1
) -> tuple[Array, float] | None:
    """Return the best of (2 n + 1)² places, brought between grid points by a parabola each way, and its support."""
    points = start_m + edges.points_m[::every]
    pixels = eye.pixels(points) - field.origin
    along = eye.pixels(start_m + edges.ahead_m[::every]) - field.origin - pixels
    height, width = field.right.shape
    is_in = (pixels >= 0).all(axis=1) & (pixels <= (width - 1, height - 1)).all(axis=1)
    if is_in.sum() * every < LEAST_POINTS:
        return None
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    slope = _slopes_at(eye, points).reshape(-1, 4)
    table = np.ascontiguousarray(np.column_stack([pixels, normal, slope])[is_in])
    i, j, peak, before_x, after_x, before_y, after_y = best_place(field.right, field.down, table, step_m, n)
    offset = step_m * np.array([i + _vertex(before_x, peak, after_x), j + _vertex(before_y, peak, after_y), 0.0])
    return start_m + offset, peak


def _slopes_at(eye: Eye, points_b: Array) -> Array:
    """Return how each point's pixel moves with the box, by differences.  (n, 3) -> (n, 2, 2) px/m"""
    x, y = STEP_M * np.eye(3)[:2]
    by_x = eye.pixels(points_b + x) - eye.pixels(points_b - x)
    by_y = eye.pixels(points_b + y) - eye.pixels(points_b - y)
    return np.stack([by_x, by_y], axis=2) / (2.0 * STEP_M)


def _vertex(before: float, peak: float, after: float) -> float:
    """Return where a parabola through a peak and its neighbours has its top, in steps from it."""
    bend = before - 2.0 * peak + after
    return float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0
