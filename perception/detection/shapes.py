"""The outlines of a scenario's things: convex bodies as points, seen as the hull of their pixels. Pure maths."""

import numpy as np
from numpy.typing import NDArray

from config.scenario import Button, Cylinder
from perception.calibration.lens import Array
from perception.detection.kernels import hull_of, paint_hull

__all__ = ["cap_points", "hull", "lying_points", "stamp", "standing_points"]

N_ROUND = 40
DOME_STEPS = (0.35, 0.65, 0.87, 1.0)
"""Heights on a dome, as shares of it, whose circles are drawn."""
ROUND = np.linspace(0.0, 2.0 * np.pi, N_ROUND, endpoint=False)
CIRCLE = np.stack([np.cos(ROUND), np.sin(ROUND)], axis=1)


def cap_points(button: Button) -> Array:
    """Return the coloured part of a button about its middle on the table: cap and dome.  -> (n, 3) m"""
    radius, top = button.diameter_m / 2.0, button.height_m
    rings = [(radius, top - button.cap_m), (radius, top)]
    rings += [(radius * float(np.sqrt(1.0 - t * t)), top + button.dome_m * t) for t in DOME_STEPS]
    return np.concatenate([_ring(r, z) for r, z in rings])


def standing_points(cylinder: Cylinder) -> Array:
    """Return a standing cylinder about the middle of its foot.  -> (n, 3) m"""
    radius = cylinder.diameter_m / 2.0
    return np.concatenate([_ring(radius, 0.0), _ring(radius, cylinder.height_m)])


def lying_points(cylinder: Cylinder, axis_rad: float) -> Array:
    """Return a lying cylinder about the point below its middle.  -> (n, 3) m"""
    radius, half = cylinder.diameter_m / 2.0, cylinder.height_m / 2.0
    along = np.array([np.cos(axis_rad), np.sin(axis_rad), 0.0])
    aside = np.array([-along[1], along[0], 0.0])
    face = radius * (CIRCLE[:, :1] * aside + CIRCLE[:, 1:] * [0.0, 0.0, 1.0]) + [0.0, 0.0, radius]
    return np.concatenate([face - half * along, face + half * along])


def hull(pixels: Array) -> Array:
    """Return the convex hull of pixels.  (n, 2) -> (m, 2)"""
    return hull_of(np.ascontiguousarray(pixels))


def stamp(mask: NDArray[np.uint8], polygon: Array, origin: Array, value: int = 255) -> None:
    """Draw a convex polygon into a mask whose first pixel is at `origin`.  (h, w), (n, 2) px, (2,)"""
    paint_hull(mask, polygon, float(origin[0]), float(origin[1]), value)


def _ring(radius: float, height: float) -> Array:
    return np.column_stack([radius * CIRCLE, np.full(N_ROUND, height)])
