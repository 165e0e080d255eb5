"""A known body's place on a plane from its silhouette: the model is moved until its middle is the picture's.

What is known to stand before the body is left out of both, so that half a body gives its place as well as a whole one.
"""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.kernels import fit_body, paint_hull

__all__ = ["Fit", "Hidden", "fit_silhouette", "fit_where_free"]

Mask = NDArray[np.uint8]


class Fit(msgspec.Struct, frozen=True, kw_only=True):
    """Where a body is, and how well it explains what is seen."""

    position_m: tuple[float, float]
    overlap: float
    """Area of model and picture both, over the area of either, where nothing stands before it."""
    visible: float
    """Share of the model that nothing known stands before."""


class Hidden:
    """Pixels that something known stands before: convex polygons, drawn where they are asked for."""

    def __init__(self, polygons: Sequence[Array]) -> None:
        self._polygons = polygons

    def free(self, origin: Array, shape: tuple[int, int]) -> Mask:
        """Return 1 where nothing known stands before what is seen.  -> (h, w)"""
        mask = np.ones(shape, np.uint8)
        for polygon in self._polygons:
            paint_hull(mask, polygon, float(origin[0]), float(origin[1]), 0)
        return mask


def fit_silhouette(eye: Eye, body: Array, start_m: Array, seen: Mask, origin: Array, hidden: Hidden) -> Fit | None:
    """Return where a body is, or None where nothing of it is left to see.

    Args:
        eye: the camera.
        body: points whose hull the body is, about its foot.  (n, 3) m
        start_m: where to begin, its foot.  (3,) m
        seen: 1 where the picture has the body's colour.  (h, w)
        origin: pixel of the picture that `seen` begins at.  (2,) px
        hidden: what stands before it.
    """
    return fit_where_free(eye, body, start_m, seen, origin, hidden.free(origin, (seen.shape[0], seen.shape[1])))


def fit_where_free(eye: Eye, body: Array, start_m: Array, seen: Mask, origin: Array, free: Mask) -> Fit | None:
    """Return the same, for several bodies that the same things stand before.  free: 1 where nothing does, (h, w)"""
    x, y, z = start_m.tolist()
    is_found, x, y, overlap, visible = fit_body(
        eye.numbers, eye.T_cb, body, (x, y, z), seen, free, float(origin[0]), float(origin[1])
    )
    return Fit(position_m=(x, y), overlap=overlap, visible=visible) if is_found else None
