"""The search of an outline's place on a picture: the part of the detection that takes a million looks a picture."""

import numpy as np

from perception.detection.kernels import LensNumbers, pixel_of
from robot.compiled import Floats2, Table, compiled
from robot.messages import Vec3

__all__ = ["SOFT", "best_place", "edge_rows"]

STEP_M = 1e-3

SOFT = 0.03
"""A change of so much of the table's brightness a pixel counts half."""


@compiled
def edge_rows(
    lens: LensNumbers, T_cb: Table, points: Table, ahead: Table, at: Vec3, origin: tuple[float, float],
    size: tuple[int, int], every: int,
) -> Table:  # fmt: skip
    """Return what `best_place` needs of a body's edges with its middle at a place, for those inside a picture.

    Args:
        lens: the lens.
        T_cb: base frame to camera frame.
        points: points of edges about the body's middle.  (n, 3) m
        ahead: a second point of each one's edge.  (n, 3) m
        at: the middle, base frame.
        origin: the picture's first pixel, column and row.
        size: its width and height.
        every: takes every so many-th point.
    """
    rows = np.empty((points.shape[0], 8))
    n = 0
    for i in range(0, points.shape[0], every):
        x, y, z = points[i, 0] + at[0], points[i, 1] + at[1], points[i, 2] + at[2]
        u, v = pixel_of(lens, T_cb, x, y, z)
        if not (origin[0] <= u <= origin[0] + size[0] - 1 and origin[1] <= v <= origin[1] + size[1] - 1):
            continue
        s, t = pixel_of(lens, T_cb, ahead[i, 0] + at[0], ahead[i, 1] + at[1], ahead[i, 2] + at[2])
        length = np.hypot(s - u, t - v)
        ahead_x, behind_x = pixel_of(lens, T_cb, x + STEP_M, y, z), pixel_of(lens, T_cb, x - STEP_M, y, z)
        ahead_y, behind_y = pixel_of(lens, T_cb, x, y + STEP_M, z), pixel_of(lens, T_cb, x, y - STEP_M, z)
        rows[n, 0], rows[n, 1] = u - origin[0], v - origin[1]
        rows[n, 2], rows[n, 3] = -(t - v) / length, (s - u) / length
        rows[n, 4], rows[n, 5] = (ahead_x[0] - behind_x[0]) / (2 * STEP_M), (ahead_y[0] - behind_y[0]) / (2 * STEP_M)
        rows[n, 6], rows[n, 7] = (ahead_x[1] - behind_x[1]) / (2 * STEP_M), (ahead_y[1] - behind_y[1]) / (2 * STEP_M)
        n += 1
    return rows[:n].copy()


@compiled
def support(grey: Floats2, edges: Table, x_m: float, y_m: float) -> float:
    """Return how surely grey changes across the edges of a body moved by (x, y): 0 to 1, their mean."""
    height, width = grey.shape
    total = 0.0
    for k in range(edges.shape[0]):
        u = edges[k, 0] + edges[k, 4] * x_m + edges[k, 5] * y_m
        v = edges[k, 1] + edges[k, 6] * x_m + edges[k, 7] * y_m
        column, row = int(u + 0.5), int(v + 0.5)
        if 0 < column < width - 1 and 0 < row < height - 1:
            right = 0.5 * (grey[row, column + 1] - grey[row, column - 1])
            down = 0.5 * (grey[row + 1, column] - grey[row - 1, column])
            change = abs(right * edges[k, 2] + down * edges[k, 3])
            total += change / (change + SOFT)
    return total / edges.shape[0]


@compiled
def best_place(
    grey: Floats2, edges: Table, step_m: float, n: int
) -> tuple[float, float, float, float, float, float, float]:
    """Return the best of (2 n + 1)² moves, in steps along x and y, its support, and that of its four neighbours.

    Args:
        grey: smooth, in the table's brightness.  (h, w)
        edges: pixel, unit normal and the pixel's slope by x and y of each point: u, v, nu, nv, ux, uy, vx, vy.  (m, 8)
        step_m: from one move to the next.
        n: steps to either side.
    """
    best, best_i, best_j = -1.0, 0, 0
    for i in range(-n, n + 1):
        for j in range(-n, n + 1):
            here = support(grey, edges, i * step_m, j * step_m)
            if here > best:
                best, best_i, best_j = here, i, j
    x, y = best_i * step_m, best_j * step_m
    return (
        float(best_i),
        float(best_j),
        best,
        support(grey, edges, x - step_m, y),
        support(grey, edges, x + step_m, y),
        support(grey, edges, x, y - step_m),
        support(grey, edges, x, y + step_m),
    )
