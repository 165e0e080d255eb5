"""Buttons: the coloured cap's silhouette for the place, the dome against the table around it for the lamp."""

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.scenario import Button
from perception.calibration.lens import Array
from perception.detection.colours import features
from perception.detection.eye import Eye
from perception.detection.glance import Glance, mask_of
from perception.detection.hiding import Hiders
from perception.detection.patches import LEFT, LOWER, N_PIXELS, RIGHT, UPPER, components, median_colour
from perception.detection.seen import Stance, ThingSeen
from perception.detection.shapes import CIRCLE, cap_points, hull, stamp
from perception.detection.silhouette import Fit, Hidden, fit_silhouette

__all__ = ["ButtonFinder", "ButtonFound"]

LEAST_OVERLAP = 0.85
LEAST_VISIBLE = 0.4
DOME_SHARE = 0.75
"""Of the cap's radius: what is read of the dome."""
RING_SHARE, BASE_SHARE = 1.7, 1.2
"""Of the cap's radius: as far as the table is read around it, and within which is its base."""
EDGE_PX = 3
"""A cap that is within its region keeps so far from the window's edge."""
RIM = np.column_stack([CIRCLE, np.zeros(len(CIRCLE))])
LEAST_READ = 0.12
"""Share of dome and of ring that must be free."""


class ButtonFound(msgspec.Struct, frozen=True, kw_only=True):
    """What was found of a button."""

    thing: ThingSeen
    reading: Array | None
    """The dome's colour in the light of the table around it; none where too little is seen.  (3,)"""


class ButtonFinder:
    """Finds one button of a scenario through one camera."""

    def __init__(self, button: Button, table_m: float, eye: Eye, bit: int) -> None:
        self._button, self._eye, self._bit, self._table_m = button, eye, bit, table_m
        self._body = cap_points(button)
        self._middle = np.array([*button.position_m, table_m])
        x, y = button.spread_m
        spread = np.array([[i * x, j * y, 0.0] for i in (-1, 1) for j in (-1, 1)])
        around = np.concatenate([eye.pixels(self._middle + s + self._body) for s in spread])
        self._low, self._high = np.floor(around.min(axis=0)) - EDGE_PX, np.ceil(around.max(axis=0)) + EDGE_PX

    def find(self, seen: Glance, hiders: Hiders) -> ButtonFound:
        """Return where the button is and how its dome looks."""
        low = np.maximum(self._low - seen.origin, 0).astype(int)
        high = np.maximum(self._high - seen.origin, 0).astype(int)
        window = seen.labels[low[1] : high[1], low[0] : high[0]]
        mask = _own(mask_of(window, self._bit))
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:
            return ButtonFound(thing=self._unseen(0.0), reading=None)
        origin = seen.origin + low
        cap_m = self._table_m + self._button.height_m - self._button.cap_m / 2.0
        u, v = float(columns.mean() + origin[0]), float(rows.mean() + origin[1])
        start = self._eye.spot(u, v, cap_m)
        if not np.isfinite(start).all():
            return ButtonFound(thing=self._unseen(0.0), reading=None)
        start[2] = self._table_m
        hidden = hiders.before(start + self._body)
        fit = fit_silhouette(self._eye, self._body, start, mask, origin, hidden)
        if fit is None or fit.overlap < LEAST_OVERLAP or fit.visible < LEAST_VISIBLE:
            return ButtonFound(thing=self._unseen(0.0 if fit is None else fit.visible), reading=None)
        return ButtonFound(thing=self._thing(fit), reading=self._reading(seen, fit, hidden))

    def _reading(self, seen: Glance, fit: Fit, hidden: Hidden) -> Array | None:
        """Return the dome's features as if the ring of table around it were the sample's table."""
        button, radius = self._button, self._button.diameter_m / 2.0
        at = np.array([*fit.position_m, self._table_m])
        top = button.height_m + 0.7 * button.dome_m
        dome = self._median(seen, hidden, at + np.array([0.0, 0.0, top]), DOME_SHARE * radius, 0.0)
        ring = self._median(seen, hidden, at, RING_SHARE * radius, BASE_SHARE * radius)
        if dome is None or ring is None or not (ring > 0.0).all():
            return None
        reference = seen.gains * seen.light
        return features((dome / ring * reference / 255.0)[None, :])[0]

    def _median(self, seen: Glance, hidden: Hidden, at: Array, radius_m: float, hole_m: float) -> Array | None:
        """Return the median colour of a disc that lies flat, less a disc about its middle.  -> (3,)"""
        rim = RIM
        outer = hull(self._eye.pixels(at + radius_m * rim))
        low = np.floor(outer.min(axis=0))
        shape = tuple(int(n) for n in (np.ceil(outer.max(axis=0)) - low + 1)[::-1])
        mask = np.zeros(shape, np.uint8)
        stamp(mask, outer, low, 1)
        if hole_m:
            lip = self._button.height_m + self._button.dome_m
            body = [at + hole_m * rim, at + np.array([0.0, 0.0, lip]) + hole_m * rim]
            stamp(mask, hull(self._eye.pixels(np.concatenate(body))), low, 0)
        n_whole = int(mask.sum())
        mask &= hidden.free(low, (shape[0], shape[1]))
        first = (low - seen.origin).astype(int)
        is_inside = (first >= 0).all() and (first + shape[::-1] <= seen.labels.shape[::-1]).all()
        if not is_inside or int(mask.sum()) < LEAST_READ * n_whole:
            return None
        return np.array(median_colour(seen.rgb, mask, int(first[0]), int(first[1])))

    def _thing(self, fit: Fit) -> ThingSeen:
        x, y = fit.position_m
        z = self._table_m + self._button.height_m - self._button.cap_m / 2.0
        return ThingSeen(
            name=self._button.name, position_m=(x, y, z), stance=Stance.FIXED, axis_rad=None,
            confidence=fit.overlap, visible=fit.visible,
        )  # fmt: skip

    def _unseen(self, visible: float) -> ThingSeen:
        return ThingSeen(
            name=self._button.name, position_m=None, stance=Stance.UNKNOWN, axis_rad=None, confidence=0.0,
            visible=visible,
        )  # fmt: skip


def _own(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a mask without what reaches into the window from beside it, unless that is the largest part.

    A lit lid's edge of nearly the cap's colour, half a window away, made a cap unknown that was whole.
    """
    labels, rows = components(mask)
    if len(rows) <= 1:
        return mask
    height, width = mask.shape
    is_out = (rows[:, LEFT] == 0) | (rows[:, UPPER] == 0)
    is_out |= (rows[:, RIGHT] == width - 1) | (rows[:, LOWER] == height - 1)
    is_out[int(rows[:, N_PIXELS].argmax())] = False
    kept = np.concatenate([[False], ~is_out])
    return kept[labels].astype(np.uint8)
