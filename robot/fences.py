"""Fences of a workspace as gaps: how far a point is on the allowed side, and which way leads off. Pure maths, compiled.

Gaps are metres, base frame, positive where it is allowed and 0 on the fence.
"""

import math

import msgspec

from robot.compiled import Table, compiled
from robot.messages import Vec3

__all__ = [
    "FenceGap",
    "FenceRow",
    "box_gap",
    "fence_away",
    "fence_gap",
    "keep_out_gap",
    "least_gap",
    "plane_gap",
    "row_of",
]

BOX, PLANE, KEEP_OUT = 0.0, 1.0, 2.0

FenceRow = tuple[float, float, float, float, float, float, float, float]
"""Kind, two corners (of a plane its normal, and nothing), and a radius (of a plane its offset)."""


@compiled
def _depth(at: Vec3, row: FenceRow) -> float:
    """Return the distance to the nearest face of a box from inside of it, negative outside."""
    x, y, z = at
    _, x0, y0, z0, x1, y1, z1, _ = row
    return min(x - x0, x1 - x, y - y0, y1 - y, z - z0, z1 - z)


@compiled
def fence_gap(row: FenceRow, at: Vec3) -> float:
    """Return how far a point is on the allowed side: what is not a number is nowhere.

    Inside of a box the distance to its nearest face; the distance to a plane; the distance to a volume that is kept
    out of, a box with rounded edges, and inside of its box what it takes to get out.
    """
    x, y, z = at
    kind, x0, y0, z0, x1, y1, z1, radius = row
    if kind == BOX:
        return _depth(at, row) if math.isfinite(x + y + z) else math.nan
    if kind == PLANE:
        return x0 * x + y0 * y + z0 * z - radius
    dx, dy, dz = max(x0 - x, x - x1), max(y0 - y, y - y1), max(z0 - z, z - z1)
    if dx <= 0.0 and dy <= 0.0 and dz <= 0.0:
        return -_depth(at, row) - radius
    dx, dy, dz = max(dx, 0.0), max(dy, 0.0), max(dz, 0.0)
    away = math.sqrt(dx * dx + dy * dy + dz * dz) - radius
    return away if math.isfinite(x + y + z) else math.nan


@compiled
def _inwards(at: Vec3, low: Vec3, high: Vec3) -> Vec3:
    """Return the direction away from the nearest face of a box."""
    (x, y, z), (x0, y0, z0), (x1, y1, z1) = at, low, high
    least = min(x - x0, x1 - x, y - y0, y1 - y, z - z0, z1 - z)
    if x - x0 == least or x1 - x == least:
        return (1.0 if x - x0 == least else -1.0), 0.0, 0.0
    if y - y0 == least or y1 - y == least:
        return 0.0, (1.0 if y - y0 == least else -1.0), 0.0
    return 0.0, 0.0, (1.0 if z - z0 == least else -1.0)


@compiled
def fence_away(row: FenceRow, at: Vec3) -> Vec3:
    """Return the direction in which a gap grows fastest, of length 1."""
    x, y, z = at
    kind, x0, y0, z0, x1, y1, z1, _ = row
    if kind == PLANE:
        return x0, y0, z0
    inwards = _inwards(at, (x0, y0, z0), (x1, y1, z1))
    if kind == BOX:
        return inwards
    dx, dy, dz = x - min(max(x, x0), x1), y - min(max(y, y0), y1), z - min(max(z, z0), z1)
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if length > 0.0:
        return dx / length, dy / length, dz / length
    return -inwards[0], -inwards[1], -inwards[2]


@compiled
def row_of(rows: Table, k: int) -> FenceRow:
    """Return one fence of a table of them, its part left out.  (n, 9), () -> (8,)"""
    return (
        rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5], rows[k, 6], rows[k, 7], rows[k, 8],
    )  # fmt: skip


@compiled
def least_gap(rows: Table, points: tuple[Vec3, Vec3, Vec3]) -> float:
    """Return the least gap of all fences, of each the part that it fences.  (n, 9), (3, 3) -> ()"""
    least = math.inf
    for k in range(rows.shape[0]):
        part = rows[k, 0]
        at = points[0] if part == 0.0 else points[1] if part == 1.0 else points[2]
        gap = fence_gap(row_of(rows, k), at)
        if not gap >= least:
            least = gap
    return least


class FenceGap(msgspec.Struct, frozen=True):
    """One fence of one part of the arm."""

    name: str
    part: int
    row: FenceRow

    def gap(self, at_m: Vec3) -> float:
        """Return how far a point is on the allowed side (fence_gap)."""
        return fence_gap(self.row, at_m)

    def away(self, at_m: Vec3) -> Vec3:
        """Return the direction in which the gap grows fastest, of length 1 (fence_away)."""
        return fence_away(self.row, at_m)


def box_gap(name: str, part: int, low_m: Vec3, high_m: Vec3) -> FenceGap:
    """Return the inside of a box."""
    return FenceGap(name, part, (BOX, *low_m, *high_m, 0.0))


def plane_gap(name: str, part: int, normal: Vec3, offset_m: float) -> FenceGap:
    """Return one side of a plane: its normal, of length 1, points to the side that is allowed."""
    return FenceGap(name, part, (PLANE, *normal, 0.0, 0.0, 0.0, offset_m))


def keep_out_gap(name: str, part: int, low_m: Vec3, high_m: Vec3, radius_m: float) -> FenceGap:
    """Return the outside of a box with rounded edges."""
    return FenceGap(name, part, (KEEP_OUT, *low_m, *high_m, radius_m))
