"""What is known to stand before other things: blocks of the boxes that were found, and the arm."""

from collections.abc import Sequence

import numpy as np

from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.shapes import hull
from perception.detection.silhouette import Hidden
from perception.detection.solids import Solid, corners, hides

__all__ = ["Hiders"]


class Hiders:
    """Blocks that may hide, and polygons that always do."""

    def __init__(self, eye: Eye, solids: Sequence[Solid], polygons: Sequence[Array] = ()) -> None:
        self._eye, self._polygons, self._solids = eye, list(polygons), solids
        self._outlines = [hull(eye.pixels(corners(solid))) for solid in solids]
        self._low = np.array([outline.min(axis=0) for outline in self._outlines]).reshape(-1, 2)
        self._high = np.array([outline.max(axis=0) for outline in self._outlines]).reshape(-1, 2)

    def before(self, points_b: Array) -> Hidden:
        """Return the outlines of all that stands before any of a body's points.  (n, 3) m"""
        pixels = self._eye.pixels(points_b)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        is_near = ((self._low < high) & (self._high > low)).all(axis=1)
        eye_m = self._eye.position_m
        inner = np.vstack([points_b, points_b.mean(axis=0)])
        found = [self._outlines[k] for k in np.flatnonzero(is_near) if hides(self._solids[k], eye_m, inner).any()]
        return Hidden(found + self._polygons)
