"""Loose cylinders: every patch of the right colour is tried as one that stands and as one that lies."""

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.scenario import Cylinder
from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.glance import Glance, mask_of
from perception.detection.hiding import Hiders
from perception.detection.patches import N_PIXELS, components
from perception.detection.seen import Stance, ThingSeen
from perception.detection.shapes import hull, lying_points, stamp, standing_points
from perception.detection.silhouette import Fit, fit_where_free
from robot.messages import Vec3

__all__ = ["CylinderFinder"]

LEAST_OVERLAP = 0.8
LEAST_VISIBLE = 0.4
SURE_OVERLAP = 0.92
"""A standing cylinder that fits so well is not tried lying."""
LEAST_LIKE = 0.3
"""What covers less of a standing one is no lying one either: that covers two thirds."""
LEAST_LEAD = 0.04
"""By so much the better stance must fit better to be told."""
LEAST_PATCH = 0.15
"""Share of a cylinder's own area that a patch must have."""
N_PATCHES = 3
REACH = 1.2
"""What was seen somewhere is looked for this many of its diagonals about it."""
N_AXES = 6
CORE = 0.4
"""Half a side of the block in a cylinder's middle that is inside of it however it lies, in its smaller size."""
LEAST_CORE_PX, FREE_CORE, GONE = 12, 0.95, 0.05
"""What is seen of that block, at the least, and how much of its colour may be there where it is said to be gone."""


class _Patch(msgspec.Struct, frozen=True, kw_only=True):
    """One patch of a cylinder's colour, alone."""

    mask: NDArray[np.uint8]
    origin: Array
    """Its first pixel in the picture."""
    middle_px: tuple[float, float]
    free: NDArray[np.uint8]
    """1 where nothing known stands before a body that is there."""


class CylinderFinder:
    """Finds one cylinder of a scenario through one camera."""

    def __init__(self, cylinder: Cylinder, table_m: float, eye: Eye, bit: int) -> None:
        self._cylinder, self._eye, self._bit, self._table_m = cylinder, eye, bit, table_m
        self._standing = standing_points(cylinder)
        reach = REACH * float(np.hypot(cylinder.diameter_m, cylinder.height_m))
        half = CORE * min(cylinder.diameter_m, cylinder.height_m) / math.sqrt(2.0)
        self._core = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half
        self._about = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * reach

    @property
    def name(self) -> str:
        """The cylinder's."""
        return self._cylinder.name

    def find(self, seen: Glance, hiders: Hiders, near: Vec3 | None = None) -> ThingSeen:
        """Return where the cylinder is; unknown where nothing of its colour has its shape.

        Args:
            seen: the picture.
            hiders: what stands before it.
            near: where the cylinder was seen before: it is looked for there alone.
        """
        low, high = seen.origin, seen.origin + np.array(seen.labels.shape[::-1])
        if near is not None:
            around = self._eye.pixels(np.array(near) + self._about)
            low, high = around.min(axis=0), around.max(axis=0)
        (left, upper), (right, lower) = seen.part(low, high)
        mask = mask_of(seen.labels[upper:lower, left:right], self._bit)
        origin = seen.origin + np.array([left, upper])
        things = [self._try(part, first, hiders) for part, first in self._patches(mask, origin)]
        told = [thing for thing in things if thing is not None]
        if told:
            return max(told, key=lambda thing: thing.confidence * thing.visible)
        return self._unseen(is_gone=near is not None and self._is_gone(near, mask, origin, hiders))

    def _patches(self, mask: NDArray[np.uint8], origin: Array) -> list[tuple[NDArray[np.uint8], Array]]:
        """Return the largest patches, each alone in a window of its own with the window's first pixel."""
        labels, rows = components(mask)
        patches = []
        for k in np.argsort(-rows[:, N_PIXELS], kind="stable")[:N_PATCHES].tolist():
            left, upper, right, lower, area = rows[k].tolist()
            middle = origin + np.array([(left + right + 1) / 2.0, (upper + lower + 1) / 2.0])
            if area < LEAST_PATCH * self._area_px(middle):
                continue
            edge = max(right - left, lower - upper) + 1
            first = np.maximum([left - edge, upper - edge], 0)
            part = labels[first[1] : lower + 1 + edge, first[0] : right + 1 + edge]
            patches.append(((part == k + 1).astype(np.uint8), origin + first))
        return patches

    def _area_px(self, middle: Array) -> float:
        """Return how many pixels a standing cylinder has there."""
        at = self._eye.spot(float(middle[0]), float(middle[1]), self._table_m)
        outline = hull(self._eye.pixels(at + self._standing))
        x, y = outline.T
        return float(abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / 2.0)

    def _try(self, mask: NDArray[np.uint8], origin: Array, hiders: Hiders) -> ThingSeen | None:
        patch = self._patch(mask, origin, hiders)
        if patch is None:
            return None
        stands = self._fit(self._standing, patch)
        lies: tuple[Fit, float] | None = None
        if stands is None or LEAST_LIKE <= stands.overlap < SURE_OVERLAP:
            lies = self._lying(patch)
        best = stands if lies is None or (stands is not None and stands.overlap >= lies[0].overlap) else lies[0]
        if best is None or best.overlap < LEAST_OVERLAP or best.visible < LEAST_VISIBLE:
            return None
        others = [f.overlap for f in (stands, None if lies is None else lies[0]) if f is not None and f is not best]
        if best.overlap - max(others, default=0.0) < LEAST_LEAD:
            return None  # the two stances are millimetres apart: neither place is known
        if best is stands:
            return self._thing(best, Stance.STANDING, None, self._cylinder.height_m / 2.0)
        assert lies is not None
        return self._thing(best, Stance.LYING, lies[1], self._cylinder.diameter_m / 2.0)

    def _lying(self, patch: _Patch) -> tuple[Fit, float] | None:
        """Return the best fit over axes all round, then around the best of them, and its axis."""
        best: tuple[Fit, float] | None = None
        step = np.pi / N_AXES
        for axis in np.arange(N_AXES) * step:
            best = self._better(best, float(axis), patch)
        for _ in range(3):
            step /= 2.0
            if best is not None:
                for axis in (best[1] - step, best[1] + step):
                    best = self._better(best, axis, patch)
        return None if best is None else (best[0], best[1] % np.pi)

    def _better(self, best: tuple[Fit, float] | None, axis_rad: float, patch: _Patch) -> tuple[Fit, float] | None:
        fit = self._fit(lying_points(self._cylinder, axis_rad), patch)
        is_better = fit is not None and (best is None or fit.overlap > best[0].overlap)
        return (fit, axis_rad) if fit is not None and is_better else best

    def _patch(self, mask: NDArray[np.uint8], origin: Array, hiders: Hiders) -> _Patch | None:
        """Return a patch with what stands before a body there; none where no ray of it meets the table."""
        rows, columns = np.nonzero(mask)
        u, v = float(columns.mean() + origin[0]), float(rows.mean() + origin[1])
        foot = self._eye.spot(u, v, self._table_m + float(self._standing[:, 2].max()) / 2.0)
        if not np.isfinite(foot).all():
            return None
        foot[2] = self._table_m
        hidden = hiders.before(foot + self._standing)
        free = hidden.free(origin, (mask.shape[0], mask.shape[1]))
        return _Patch(mask=mask, origin=origin, middle_px=(u, v), free=free)

    def _fit(self, body: Array, patch: _Patch) -> Fit | None:
        start = self._eye.spot(*patch.middle_px, self._table_m + float(body[:, 2].max()) / 2.0)
        if not np.isfinite(start).all():
            return None
        start[2] = self._table_m
        return fit_where_free(self._eye, body, start, patch.mask, patch.origin, patch.free)

    def _thing(self, fit: Fit, stance: Stance, axis_rad: float | None, above_m: float) -> ThingSeen:
        x, y = fit.position_m
        return ThingSeen(
            name=self._cylinder.name, position_m=(x, y, self._table_m + above_m), stance=stance, axis_rad=axis_rad,
            confidence=fit.overlap, visible=fit.visible,
        )  # fmt: skip

    def _is_gone(self, near: Vec3, mask: NDArray[np.uint8], origin: Array, hiders: Hiders) -> bool:
        """Tell whether one sees past the middle of a cylinder that was there, whichever way it stood."""
        core = np.array(near) + self._core
        inside = np.zeros(mask.shape, np.uint8)
        stamp(inside, hull(self._eye.pixels(core)), origin, 1)
        n_inside = int(inside.sum())
        free = inside & hiders.before(core).free(origin, (mask.shape[0], mask.shape[1]))
        n_free = int(free.sum())
        n_like = int((free & mask).sum())
        return n_inside >= LEAST_CORE_PX and n_free >= FREE_CORE * n_inside and n_like <= GONE * n_free

    def _unseen(self, *, is_gone: bool) -> ThingSeen:
        return ThingSeen(
            name=self._cylinder.name, position_m=None, stance=Stance.UNKNOWN, axis_rad=None, confidence=0.0,
            visible=0.0, is_gone=is_gone,
        )  # fmt: skip
