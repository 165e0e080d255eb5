"""The search of an outline's place on a picture: the part of the detection that takes a million looks a picture."""

from robot.compiled import Table, compiled

__all__ = ["SOFT", "best_place"]

SOFT = 0.03
"""A change of so much of the table's brightness a pixel counts half."""


@compiled
def support(right: Table, down: Table, edges: Table, x_m: float, y_m: float) -> float:
    """Return how surely grey changes across the edges of a body moved by (x, y): 0 to 1, their mean."""
    height, width = right.shape
    total = 0.0
    for k in range(edges.shape[0]):
        u = edges[k, 0] + edges[k, 4] * x_m + edges[k, 5] * y_m
        v = edges[k, 1] + edges[k, 6] * x_m + edges[k, 7] * y_m
        column, row = int(u + 0.5), int(v + 0.5)
        if 0 <= column < width and 0 <= row < height:
            change = abs(right[row, column] * edges[k, 2] + down[row, column] * edges[k, 3])
            total += change / (change + SOFT)
    return total / edges.shape[0]


@compiled
def best_place(
    right: Table, down: Table, edges: Table, step_m: float, n: int
) -> tuple[float, float, float, float, float, float, float]:
    """Return the best of (2 n + 1)² moves, in steps along x and y, its support, and that of its four neighbours.

    Args:
        right: how grey rises to the right.  (h, w)
        down: and down.  (h, w)
        edges: pixel, unit normal and the pixel's slope by x and y of each point: u, v, nu, nv, ux, uy, vx, vy.  (m, 8)
        step_m: from one move to the next.
        n: steps to either side.
    """
    best, best_i, best_j = -1.0, 0, 0
    for i in range(-n, n + 1):
        for j in range(-n, n + 1):
            here = support(right, down, edges, i * step_m, j * step_m)
            if here > best:
                best, best_i, best_j = here, i, j
    x, y = best_i * step_m, best_j * step_m
    return (
        float(best_i),
        float(best_j),
        best,
        support(right, down, edges, x - step_m, y),
        support(right, down, edges, x + step_m, y),
        support(right, down, edges, x, y - step_m),
        support(right, down, edges, x, y + step_m),
    )
