"""How blurred a board is in a picture, from the straight edges on it. Pure maths.

Across an ideal edge blurred by a Gaussian of standard deviation s, grey rises by its contrast C with a steepest slope
of C / (s sqrt(2 pi)) a pixel. s in pixels is what is told: 0.4 to 0.8 for a lens in focus.
"""

import numpy as np
from numpy.typing import NDArray

from perception.calibration.board import Board, grid_of
from perception.calibration.lens import Array

__all__ = ["blur_px", "edges_of_corners", "edges_of_quads"]

ALONG = np.linspace(0.3, 0.7, 9)
"""Where on an edge profiles are taken, as shares of it: away from its ends."""
REACH = 0.11
"""How far a profile goes to either side, as a share of a square: markers begin at an eighth."""
LEAST_REACH_PX, MOST_REACH_PX = 1.5, 12.0
STEP_PX = 0.25
LEAST_EDGES = 8
WHITE_SHARE, BLACK_SHARE = 98.0, 2.0
WORSE = 75.0
"""Motion blurs the edges across it and not those along it: the middle of the worse half is told."""


def blur_px(grey: NDArray[np.uint8], edges: Array) -> float:
    """Return the blur across edges, px, given as their ends; infinite where they are too few to tell.  (n, 2, 2)"""
    if len(edges) < LEAST_EDGES:
        return float("inf")
    places = edges.reshape(-1, 2)
    low, high = np.floor(places.min(axis=0)).astype(int), np.ceil(places.max(axis=0)).astype(int)
    inside = grey[max(low[1], 0) : high[1] + 1, max(low[0], 0) : high[0] + 1]
    contrast = float(np.percentile(inside, WHITE_SHARE) - np.percentile(inside, BLACK_SHARE)) if inside.size else 0.0
    if contrast <= 0.0:
        return float("inf")
    return float(np.percentile([_edge_blur(grey, start, end, contrast) for start, end in edges], WORSE))


def edges_of_corners(board: Board, pixel_by_corner: dict[int, Array]) -> Array:
    """Return the squares' edges between corners that were found beside each other.  -> (n, 2, 2) px"""
    edges = []
    for corner, start in pixel_by_corner.items():
        column, _ = grid_of(board, corner)
        beside = [corner + board.n_columns - 1, *([corner + 1] if column + 2 < board.n_columns else [])]
        edges += [(start, pixel_by_corner[other]) for other in beside if other in pixel_by_corner]
    return np.array(edges).reshape(-1, 2, 2)


def edges_of_quads(quads: Array) -> Array:
    """Return the sides of four-cornered spots, markers or not.  (n, 4, 2) -> (4 n, 2, 2) px"""
    return np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2, 2)


def _edge_blur(grey: NDArray[np.uint8], start: Array, end: Array, contrast: float) -> float:
    """Return the blur of one edge between two corners, px."""
    along = end - start
    length = float(np.linalg.norm(along))
    if length < 1.0:
        return float("inf")
    across = np.array([-along[1], along[0]]) / length
    reach = min(max(REACH * length, LEAST_REACH_PX), MOST_REACH_PX)
    offsets = np.arange(-reach, reach + STEP_PX / 2, STEP_PX)
    points = start + ALONG[:, None, None] * along + offsets[None, :, None] * across
    profile = _sampled(grey, points).mean(axis=0)
    n = round(1.0 / STEP_PX)
    slope = float(np.abs(profile[n:] - profile[:-n]).max())
    return contrast / (max(slope, 1e-6) * float(np.sqrt(2.0 * np.pi)))


def _sampled(grey: NDArray[np.uint8], points: Array) -> Array:
    """Return grey at points between pixels, bilinear, the nearest one's beyond the edge.  (..., 2) -> (...)"""
    height, width = grey.shape
    x = np.clip(points[..., 0], 0.0, width - 1.001)
    y = np.clip(points[..., 1], 0.0, height - 1.001)
    left, upper = x.astype(int), y.astype(int)
    u, v = x - left, y - upper
    a = grey[upper, left] * (1 - u) + grey[upper, left + 1] * u
    b = grey[upper + 1, left] * (1 - u) + grey[upper + 1, left + 1] * u
    return a * (1 - v) + b * v
