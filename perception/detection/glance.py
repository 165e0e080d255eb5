"""One picture made ready to be looked at: the part that things can be in, its light, its colours, its slopes."""

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.scenario import Scenario
from perception.calibration.lens import Array
from perception.detection.colours import GREY_WEIGHTS
from perception.detection.eye import Eye
from perception.detection.light import EVERY_PX, gains, table_light
from perception.detection.outline import Smooth, smooth
from perception.detection.palette import Palette
from perception.detection.shapes import hull, stamp
from robot.frames import Picture

__all__ = ["Field", "Glance", "glance", "mask_of"]

MARGIN_M = 0.10
"""What stands at the workspace's edge reaches out of it."""
HIGHEST_M = 0.20


class Field(msgspec.Struct, frozen=True, kw_only=True):
    """Which pixels of a camera matter for a scenario."""

    left: int
    upper: int
    right: int
    lower: int
    table: NDArray[np.bool_]
    """Of every sixth pixel of the whole picture: is the table top behind it?"""

    @property
    def origin(self) -> Array:
        """First pixel, column and row."""
        return np.array([self.left, self.upper], dtype=np.float64)

    @staticmethod
    def of(eye: Eye, scenario: Scenario) -> "Field":
        """Return the field in which a scenario's things are."""
        table, size = scenario.table, (eye.lens.height_px, eye.lens.width_px)
        half = np.array(table.size_m) / 2.0
        low, high = np.array(table.centre_m) - half, np.array(table.centre_m) + half
        top = hull(eye.pixels(_block(low, high, table.height_m, table.height_m)))
        mask = np.zeros(size, np.uint8)
        stamp(mask, top, np.zeros(2), 1)
        if scenario.workspace_m is not None:
            (ax, ay, _), (bx, by, _) = scenario.workspace_m
            low = np.maximum(low, np.array([ax, ay]) - MARGIN_M)
            high = np.minimum(high, np.array([bx, by]) + MARGIN_M)
        around = eye.pixels(_block(low, high, table.height_m, table.height_m + HIGHEST_M))
        first = np.maximum(np.floor(np.nanmin(around, axis=0)), 0).astype(int)
        last = np.minimum(np.ceil(np.nanmax(around, axis=0)), (size[1], size[0])).astype(int)
        return Field(
            left=int(first[0]), upper=int(first[1]), right=int(last[0]), lower=int(last[1]),
            table=mask[::EVERY_PX, ::EVERY_PX] > 0,
        )  # fmt: skip


class Glance(msgspec.Struct, frozen=True, kw_only=True):
    """A picture's field, ready."""

    rgb: NDArray[np.uint8]
    labels: NDArray[np.uint32]
    origin: Array
    gains: Array
    light: Array

    def part(self, low: Array, high: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the first pixel of a part of the field and the one past its last, about pixels of the picture."""
        size = np.array(self.labels.shape[::-1])
        first = np.clip(np.floor(low - self.origin).astype(np.int64), 0, size)
        return first, np.clip(np.ceil(high - self.origin).astype(np.int64), first, size)

    def smooth(self, low: Array, high: Array) -> Smooth:
        """Return the grey of the field between two pixels of the picture."""
        (left, upper), (right, lower) = self.part(low, high)
        origin = self.origin + np.array([left, upper])
        return smooth(self.rgb[upper:lower, left:right], origin, float(self.light @ GREY_WEIGHTS))


def mask_of(labels: NDArray[np.uint32], bit: int) -> NDArray[np.uint8]:
    """Return 1 where a thing's colour is.  (h, w) -> (h, w)"""
    return ((labels & np.uint32(bit)) != 0).astype(np.uint8)


def glance(picture: Picture, field: Field, palette: Palette, reference_rgb: Array) -> Glance | None:
    """Return a picture's field with its light balanced; None where the table's light cannot be told."""
    light = table_light(picture, field.table)
    if light is None:
        return None
    rgb = picture[field.upper : field.lower, field.left : field.right].copy()
    gain = gains(light, reference_rgb)
    return Glance(
        rgb=rgb,
        labels=palette.label(rgb, gain),
        origin=field.origin,
        gains=gain,
        light=light,
    )


def _block(low: Array, high: Array, bottom_m: float, top_m: float) -> Array:
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (bottom_m, top_m)])
