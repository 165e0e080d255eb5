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
        self._eye, self._polygons = eye, list(polygons)
        self._solids = [(solid, hull(eye.pixels(corners(solid)))) for solid in solids]

    def before(self, points_b: Array) -> Hidden:
        """Return the outlines of all that stands before any of a body's points.  (n, 3) m"""
        pixels = self._eye.pixels(points_b)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        near = [
            (solid, outline)
            for solid, outline in self._solids
            if (outline.min(axis=0) < high).all() and (outline.max(axis=0) > low).all()
        ]
        eye_m = self._eye.position_m
        inner = np.vstack([points_b, points_b.mean(axis=0)])
        return Hidden([o for solid, o in near if hides(solid, eye_m, inner).any()] + self._polygons)
