"""A known body's place on a plane from its silhouette: the model is moved until its middle is the picture's.

What is known to stand before the body is left out of both, so that half a body gives its place as well as a whole one.
"""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.shapes import hull, stamp

__all__ = ["Fit", "Hidden", "fit_silhouette"]

AROUND_PX = 8
"""So far about the model's outline pixels count, for its middle and against it."""
N_STEPS = 10
STILL_PX = 0.02
LEAST_GAIN = 0.6
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
        self._polygons = [(p, p.min(axis=0), p.max(axis=0)) for p in polygons]

    def free(self, origin: Array, shape: tuple[int, int]) -> Mask:
        """Return 1 where nothing known stands before what is seen.  -> (h, w)"""
        mask = np.zeros(shape, np.uint8)
        end = origin + np.array([shape[1], shape[0]])
        for polygon, low, high in self._polygons:
            if (low < end).all() and (high > origin).all():
                stamp(mask, polygon, origin, 1)
        return 1 - mask


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
    place = start_m.copy()
    best: Fit | None = None
    for _ in range(N_STEPS):
        outline = hull(eye.pixels(place + body))
        if not np.isfinite(outline).all():
            return best
        cut = _Cut(outline, seen, origin, hidden)
        if cut.n_model == 0 or cut.n_seen == 0:
            return best
        best = Fit(position_m=(float(place[0]), float(place[1])), overlap=cut.overlap, visible=cut.visible)
        # Of a body that is cut off by what stands before it, the middle moves by less than the body.
        shift = (cut.seen_middle - cut.model_middle) / max(cut.visible, LEAST_GAIN)
        if float(np.abs(shift).max()) < STILL_PX:
            break
        middle = place + np.array([0.0, 0.0, float(body[:, 2].max()) / 2.0])
        place = place + np.append(np.linalg.solve(eye.slope(middle), shift), 0.0)
    return best


class _Cut:
    """Model and picture within a window about the model's outline."""

    def __init__(self, outline: Array, seen: Mask, origin: Array, hidden: Hidden) -> None:
        low = np.maximum(np.floor(outline.min(axis=0)) - AROUND_PX - origin, 0).astype(int)
        high = np.minimum(np.ceil(outline.max(axis=0)) + AROUND_PX + 1 - origin, seen.shape[::-1]).astype(int)
        shape = (max(high[1] - low[1], 0), max(high[0] - low[0], 0))
        corner = origin + low
        model = np.zeros(shape, np.uint8)
        stamp(model, _drawn_in(outline), corner, 1)
        free = hidden.free(corner, shape)
        window = seen[low[1] : low[1] + shape[0], low[0] : low[0] + shape[1]] & free
        whole, model = int(model.sum()), model & free
        self.n_model, self.n_seen = int(model.sum()), int(window.sum())
        self.visible = self.n_model / max(whole, 1)
        self.overlap = int((model & window).sum()) / max(int((model | window).sum()), 1)
        self.model_middle, self.seen_middle = _middle(model), _middle(window)


def _drawn_in(outline: Array) -> Array:
    """Return an outline half a pixel smaller: what fills a polygon takes every pixel that its edge touches."""
    apart = outline - outline.mean(axis=0)
    return outline - 0.5 * apart / np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1.0)


def _middle(mask: Mask) -> Array:
    """Return the mean column and row of a mask's pixels.  (h, w) -> (2,)"""
    n = max(int(mask.sum()), 1)
    columns, rows = mask.sum(axis=0, dtype=np.int64), mask.sum(axis=1, dtype=np.int64)
    return np.array([columns @ np.arange(len(columns)) / n, rows @ np.arange(len(rows)) / n])
