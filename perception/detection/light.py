"""What light a picture was taken in, told by the table: it is the largest thing there, and its colour is known."""

import numpy as np
from numpy.typing import NDArray

from perception.calibration.lens import Array
from perception.detection.colours import GREY_WEIGHTS
from robot.compiled import Table, compiled
from robot.frames import Picture
from robot.messages import Vec3

__all__ = ["gains", "table_light"]

EVERY_PX = 6
LIT_SHARE = 70.0
"""Of the table's pixels, by brightness: most of them are in no shadow."""
SAME_TINT = 0.06
"""Pixels whose share of red and of blue differs from the median's by less are the table."""
SATURATED = 252
DARK = 2.0
LEAST_PIXELS = 100
WEIGHTS = (float(GREY_WEIGHTS[0]), float(GREY_WEIGHTS[1]), float(GREY_WEIGHTS[2]))


def table_light(picture: Picture, inside: NDArray[np.bool_]) -> Array | None:
    """Return the lit table's colour, 0 to 255; none where it cannot be told (dark, full, hidden).  -> (3,)

    Args:
        picture: what was taken.
        inside: where in it the table top is, on every sixth pixel of it.
    """
    seen = told_apart(picture[::EVERY_PX, ::EVERY_PX][inside].astype(np.float64))
    if len(seen) < LEAST_PIXELS:
        return None
    table = of_one_tint(seen)
    return np.array(lit_colour(table)) if len(table) >= LEAST_PIXELS else None


@compiled
def told_apart(pixels: Table) -> Table:
    """Return those pixels that are neither dark nor full.  (n, 3) -> (m, 3)"""
    n, kept = 0, np.empty_like(pixels)
    for i in range(pixels.shape[0]):
        r, g, b = pixels[i, 0], pixels[i, 1], pixels[i, 2]
        if max(r, g, b) < SATURATED and min(r, g, b) > DARK:
            kept[n, 0], kept[n, 1], kept[n, 2] = r, g, b
            n += 1
    return kept[:n].copy()


@compiled
def of_one_tint(pixels: Table) -> Table:
    """Return those pixels whose shares of red, green and blue are near the medians of all.  (n, 3) -> (m, 3)"""
    n = pixels.shape[0]
    sums = pixels[:, 0] + pixels[:, 1] + pixels[:, 2]
    red, green, blue = pixels[:, 0] / sums, pixels[:, 1] / sums, pixels[:, 2] / sums
    r, g, b = np.median(red), np.median(green), np.median(blue)
    m, kept = 0, np.empty_like(pixels)
    for i in range(n):
        if max(abs(red[i] - r), abs(green[i] - g), abs(blue[i] - b)) < SAME_TINT / 3.0:
            kept[m, 0], kept[m, 1], kept[m, 2] = pixels[i, 0], pixels[i, 1], pixels[i, 2]
            m += 1
    return kept[:m].copy()


@compiled
def lit_colour(table: Table) -> Vec3:
    """Return the median colour of a table's lit pixels.  (n, 3)"""
    grey = WEIGHTS[0] * table[:, 0] + WEIGHTS[1] * table[:, 1] + WEIGHTS[2] * table[:, 2]
    level = np.percentile(grey, LIT_SHARE)
    lit = np.abs(grey - level) <= 0.1 * level
    return float(np.median(table[lit, 0])), float(np.median(table[lit, 1])), float(np.median(table[lit, 2]))


def gains(light: Array, reference: Array) -> Array:
    """Return what each channel is multiplied by to be as in the reference's light (von Kries).  (3,), (3,) -> (3,)"""
    return reference / light
