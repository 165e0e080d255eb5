"""A box's walls and leaves as bodies with straight sides: what they hide, and the edges that they show. Pure maths."""

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.scenario import Box
from perception.calibration.lens import Array

__all__ = ["Edges", "Solid", "box_edges", "box_solids", "corners", "hides", "moved"]

SHRUNK_M = 0.001
"""What is nearer to a body's surface than this is not hidden by it: its own edges."""
SPACING_M = 0.005
RIM_M = 1e-6
LEAF_GAP_M = 0.001
"""Between two shut leaves."""


class Solid(msgspec.Struct, frozen=True, kw_only=True):
    """A block: its middle, its half sides and its turn, relative to the box's middle on the table."""

    centre_m: Array
    half_m: Array
    R: Array
    """From the block's frame to the base frame's directions.  (3, 3)"""


class Edges(msgspec.Struct, frozen=True, kw_only=True):
    """Points on straight edges, and a second point of the same edge for each, relative to the box's middle."""

    points_m: Array
    """(n, 3)"""
    ahead_m: Array
    """(n, 3)"""


def box_solids(box: Box, *, lid_rad: float | None) -> list[Solid]:
    """Return a box's four walls, and its leaves turned by an angle from shut; none where it has no lid."""
    (lx, ly), w, h = box.inner_m, box.wall_m, box.height_m
    solids = [
        _upright((sx * (lx + w) / 2.0, sy * (ly + w) / 2.0, h / 2.0), (half_x, half_y, h / 2.0))
        for sx, sy, half_x, half_y in (
            (1, 0, w / 2, ly / 2 + w), (-1, 0, w / 2, ly / 2 + w), (0, 1, lx / 2, w / 2), (0, -1, lx / 2, w / 2)
        )
    ]  # fmt: skip
    if box.lid is None or lid_rad is None:
        return solids
    reach = lx / 2.0 + w / 2.0
    half_thick = (box.lid.thickness_m + box.lid.padding_m) / 2.0
    for sign in (-1.0, 1.0):
        c, s = np.cos(lid_rad), sign * np.sin(lid_rad)
        R = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        middle = np.array([-sign * (reach - LEAF_GAP_M) / 2.0, 0.0, box.lid.padding_m / 2.0])
        hinge = np.array([sign * reach, 0.0, h + box.lid.thickness_m / 2.0])
        half = np.array([(reach - LEAF_GAP_M) / 2.0, ly / 2.0 + w, half_thick])
        solids.append(Solid(centre_m=hinge + R @ middle, half_m=half, R=R))
    return solids


def corners(solid: Solid) -> Array:
    """Return a block's eight corners.  -> (8, 3) m"""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=np.float64)
    return solid.centre_m + (signs * solid.half_m) @ solid.R.T


def moved(solid: Solid, by_m: Array) -> Solid:
    """Return a block somewhere else.  (3,) m"""
    return Solid(centre_m=solid.centre_m + by_m, half_m=solid.half_m, R=solid.R)


def hides(solid: Solid, eye_m: Array, points_m: Array) -> NDArray[np.bool_]:
    """Return which points a block stands before, seen from an eye: the slab test on each line of sight.  (n, 3)"""
    half = np.maximum(solid.half_m - SHRUNK_M, 0.0)
    start = (eye_m - solid.centre_m) @ solid.R
    way = (points_m - eye_m) @ solid.R
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-half - start) / way, (half - start) / way
    first = np.nanmax(np.minimum(a, b), axis=1)
    last = np.nanmin(np.maximum(a, b), axis=1)
    return (first < np.minimum(last, 1.0)) & (last > 0.0)


def box_edges(box: Box, *, lid_rad: float | None, eye_m: Array) -> Edges:
    """Return points of the edges that can be seen of a box from an eye; both relative to its middle on the table."""
    solids = box_solids(box, lid_rad=lid_rad)
    points, ahead = [], []
    for start, end in _box_lines(box, solids[4:], is_shut=lid_rad == 0.0):
        n = max(round(float(np.linalg.norm(end - start)) / SPACING_M), 2)
        share = ((np.arange(n) + 0.5) / n)[:, None]
        points.append(start + share * (end - start))
        ahead.append(points[-1] + 0.25 * (end - start) / n)
    place, beside = np.concatenate(points), np.concatenate(ahead)
    is_hidden = np.any([hides(solid, eye_m, place) for solid in solids], axis=0)
    return Edges(points_m=np.ascontiguousarray(place[~is_hidden]), ahead_m=np.ascontiguousarray(beside[~is_hidden]))


def _box_lines(box: Box, leaves: list[Solid], *, is_shut: bool) -> list[tuple[Array, Array]]:
    """Return the edges of walls and leaves.

    Where leaves lie on the rim they are flush with the walls: rim and lower edges of the leaves show no change of grey
    there, and drew the fit 1 mm towards the leaves' upper edges.
    """
    (lx, ly), w, h = box.inner_m, box.wall_m, box.height_m
    lines = _block_lines(_upright((0.0, 0.0, h / 2), (lx / 2 + w, ly / 2 + w, h / 2)))
    lines += _rectangle(lx / 2, ly / 2, h)
    flaps = [line for leaf in leaves for line in _block_lines(leaf)]
    if not (is_shut and leaves):
        return lines + flaps
    below = h + RIM_M
    return [line for line in lines if min(p[2] for p in line) < h - RIM_M] + [
        line for line in flaps if max(p[2] for p in line) > below
    ]


def _upright(centre: tuple[float, ...], half: tuple[float, ...]) -> Solid:
    return Solid(centre_m=np.array(centre), half_m=np.array(half), R=np.eye(3))


def _block_lines(solid: Solid) -> list[tuple[Array, Array]]:
    """Return the twelve edges of a block."""
    all_corners = corners(solid)
    pairs = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
    return [(all_corners[i], all_corners[j]) for i, j in pairs]


def _rectangle(half_x: float, half_y: float, z: float) -> list[tuple[Array, Array]]:
    ring = [np.array([x, y, z]) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))] * np.array([half_x, half_y, 1.0])
    return [(ring[i], ring[(i + 1) % 4]) for i in range(4)]
