"""What light a picture was taken in, told by the table: it is the largest thing there, and its colour is known."""

import numpy as np
from numpy.typing import NDArray

from perception.calibration.lens import Array
from perception.detection.colours import GREY_WEIGHTS
from robot.frames import Picture

__all__ = ["gains", "table_light"]

EVERY_PX = 6
LIT_SHARE = 70.0
"""Of the table's pixels, by brightness: most of them are in no shadow."""
SAME_TINT = 0.06
"""Pixels whose share of red and of blue differs from the median's by less are the table."""
SATURATED = 252
LEAST_PIXELS = 100


def table_light(picture: Picture, inside: NDArray[np.bool_]) -> Array | None:
    """Return the lit table's colour, 0 to 255; none where it cannot be told (dark, full, hidden).  -> (3,)

    Args:
        picture: what was taken.
        inside: where in it the table top is, on every sixth pixel of it.
    """
    seen = picture[::EVERY_PX, ::EVERY_PX][inside].astype(np.float64)
    seen = seen[(seen.max(axis=1) < SATURATED) & (seen.min(axis=1) > 2.0)]
    if len(seen) < LEAST_PIXELS:
        return None
    tint = seen / seen.sum(axis=1, keepdims=True)
    is_table = (np.abs(tint - np.median(tint, axis=0)) < SAME_TINT / 3.0).all(axis=1)
    if is_table.sum() < LEAST_PIXELS:
        return None
    table = seen[is_table]
    grey = table @ GREY_WEIGHTS
    level = np.percentile(grey, LIT_SHARE)
    return np.median(table[np.abs(grey - level) <= 0.1 * level], axis=0)


def gains(light: Array, reference: Array) -> Array:
    """Return what each channel is multiplied by to be as in the reference's light (von Kries).  (3,), (3,) -> (3,)"""
    return reference / light
