"""What a margin in metres is a share of."""

import numpy as np

from config.limits import KeepOut, Plane
from config.values import Point

__all__ = ["keep_out_scale_m", "least_half_m", "plane_scale_m"]

LEAST_SCALE_M = 0.1


def plane_scale_m(plane: Plane) -> float:
    """Return what a plane's margin is a share of: how far the plane is from the base, 0.1 m at least."""
    return max(abs(float(np.dot(plane.point_m, plane.normal))) / float(np.linalg.norm(plane.normal)), LEAST_SCALE_M)


def keep_out_scale_m(keep: KeepOut) -> float:
    """Return what a keep-out's margin is a share of: half its least width."""
    return least_half_m(keep.low_m, keep.high_m) + keep.radius_m


def least_half_m(low_m: Point, high_m: Point) -> float:
    """Return half the least width of a box."""
    return float(np.subtract(high_m, low_m).min()) / 2.0
