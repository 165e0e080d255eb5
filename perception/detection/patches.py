"""Connected patches of a mask: which pixel belongs to which, and where each lies. Compiled maths."""

import numpy as np

from robot.compiled import Bytes2, Bytes3, Ints2, compiled
from robot.messages import Vec3

__all__ = ["LEFT", "LOWER", "N_PIXELS", "RIGHT", "UPPER", "components", "median_colour"]

LEFT, UPPER, RIGHT, LOWER, N_PIXELS = range(5)
"""Columns of the table of patches; the last column and row are of the patch too."""


@compiled
def components(mask: Bytes2) -> tuple[Ints2, Ints2]:
    """Return the patch of each pixel, from 1 on, and a row for each patch; pixels that share a side are together.

    Args:
        mask: not 0 where there is something.  (h, w)

    Returns:
        Patches' numbers, 0 where there is nothing, (h, w); first and last column and row and how many pixels, (n, 5).
    """
    height, width = mask.shape
    labels = np.zeros((height, width), np.int32)
    rows = np.zeros((height * width // 2 + 1, 5), np.int32)
    waiting = np.empty(height * width, np.int64)
    n = 0
    for row in range(height):
        for column in range(width):
            if mask[row, column] == 0 or labels[row, column] != 0:
                continue
            n += 1
            left, upper, right, lower, n_pixels = column, row, column, row, 0
            labels[row, column] = n
            waiting[0], n_waiting = row * width + column, 1
            while n_waiting > 0:
                n_waiting -= 1
                i, j = waiting[n_waiting] // width, waiting[n_waiting] % width
                left, right = min(left, j), max(right, j)
                lower = max(lower, i)
                n_pixels += 1
                for k, m in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
                    if 0 <= k < height and 0 <= m < width and mask[k, m] != 0 and labels[k, m] == 0:
                        labels[k, m] = n
                        waiting[n_waiting] = k * width + m
                        n_waiting += 1
            rows[n - 1, 0], rows[n - 1, 1], rows[n - 1, 2], rows[n - 1, 3] = left, upper, right, lower
            rows[n - 1, 4] = n_pixels
    return labels, rows[:n].copy()


@compiled
def median_colour(picture: Bytes3, mask: Bytes2, left: int, upper: int) -> Vec3:
    """Return the median red, green and blue of the pixels of a picture under a mask that begins at (left, upper)."""
    height, width = mask.shape
    seen = np.empty((3, height * width))
    n = 0
    for row in range(height):
        for column in range(width):
            if mask[row, column] != 0:
                for k in range(3):
                    seen[k, n] = picture[upper + row, left + column, k]
                n += 1
    return float(np.median(seen[0, :n])), float(np.median(seen[1, :n])), float(np.median(seen[2, :n]))
