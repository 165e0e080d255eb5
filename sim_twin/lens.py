"""The lens of a simulated camera: which way each of its pixels looks. Pure maths.

Written apart from perception's: what calibrates a lens must not share a line with what bends the light, or an error in
both would never show. Radial and tangential terms after Brown (1971); the inverse by fixed-point steps.
"""

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

__all__ = ["TrueLens", "bent_pixels", "directions", "half_angles", "source_map"]

Array = NDArray[np.float64]
N_STEPS = 60


class TrueLens(msgspec.Struct, frozen=True, kw_only=True):
    """A lens as it is; pixel (0, 0) has its centre there."""

    width_px: Annotated[int, Meta(ge=16)]
    height_px: Annotated[int, Meta(ge=16)]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    radial: tuple[float, float] = (0.0, 0.0)
    tangential: tuple[float, float] = (0.0, 0.0)


def directions(lens: TrueLens) -> Array:
    """Return where each pixel looks, as tangents to the right and down.  -> (height, width, 2)"""
    u, v = np.meshgrid(np.arange(lens.width_px), np.arange(lens.height_px))
    bent = np.stack([(u - lens.centre_px[0]) / lens.focal_px[0], (v - lens.centre_px[1]) / lens.focal_px[1]], axis=2)
    (a, b), (p, q) = lens.radial, lens.tangential
    straight = bent.copy()
    for _ in range(N_STEPS):
        x, y = straight[..., 0], straight[..., 1]
        square = x**2 + y**2
        gain = 1.0 + a * square + b * square**2
        aside = np.stack([2 * p * x * y + q * (square + 2 * x**2), p * (square + 2 * y**2) + 2 * q * x * y], axis=2)
        step = (bent - aside) / gain[..., None] - straight
        straight += step
        if np.abs(step).max() < 1e-10:
            return straight.astype(np.float64)
    raise ValueError(f"a lens whose pictures fold: expected weaker distortion than {lens.radial}")


def bent_pixels(lens: TrueLens, tangents: Array) -> Array:
    """Return at which pixels directions are seen.  (n, 2) tangents -> (n, 2) px"""
    x, y = tangents.T
    (a, b), (p, q) = lens.radial, lens.tangential
    square = x**2 + y**2
    gain = 1.0 + a * square + b * square**2
    u = x * gain + 2 * p * x * y + q * (square + 2 * x**2)
    v = y * gain + p * (square + 2 * y**2) + 2 * q * x * y
    return np.column_stack([u * lens.focal_px[0] + lens.centre_px[0], v * lens.focal_px[1] + lens.centre_px[1]])


def half_angles(tangents: Array) -> tuple[float, float]:
    """Return the tangents of the half angles of a straight picture that holds all directions.  -> (), ()"""
    return float(np.abs(tangents[..., 0]).max()) * 1.01, float(np.abs(tangents[..., 1]).max()) * 1.01


def source_map(tangents: Array, half: tuple[float, float], size: tuple[int, int]) -> Array:
    """Return from where in a straight picture each pixel takes its light, pixel centres at whole numbers.

    Args:
        tangents: where each pixel looks.  (height, width, 2)
        half: tangents of the straight picture's half angles.
        size: its width and height in pixels.
    """
    share = (tangents / np.array(half) + 1.0) / 2.0
    return share * np.array(size) - 0.5
