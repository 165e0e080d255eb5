"""A camera's lens: pinhole with Brown-Conrady distortion. Points to pixels and back. Pure maths.

Camera frame: z ahead, x to the right and y down in the picture. The centre of the upper left pixel is (0, 0).
D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971; the order of the coefficients
and the factor 2 of the tangential terms as in Heikkilä and Silvén, CVPR 1997.
"""

import functools
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from config.values import Positive, Section

__all__ = ["Array", "Lens", "fold_radius", "intersect_height", "project", "ray_jacobian", "rays"]

Array = NDArray[np.float64]
Size = Annotated[int, Meta(ge=16, le=20_000)]
Coefficient = Annotated[float, Meta(ge=-50.0, le=50.0)]
N_NEWTON = 30
CONVERGED = 1e-12
STILL = 1e-14
LEAST_DEPTH_M = 1e-6
LEAST_CURVE = 1e-6
"""A lens that folds 1,000 focal lengths aside does not."""


class Lens(Section, frozen=True, kw_only=True):
    """What turns directions into pixels for one camera at one picture size."""

    width_px: Size
    height_px: Size
    fx_px: Positive
    fy_px: Positive
    cx_px: float
    cy_px: float
    k1: Coefficient = 0.0
    k2: Coefficient = 0.0
    p1: Coefficient = 0.0
    p2: Coefficient = 0.0
    k3: Coefficient = 0.0


def project(lens: Lens, points_c: Array) -> Array:
    """Return where points of the camera frame are seen.  (n, 3) m -> (n, 2) px

    NaN for a point that is not in front of the lens, or so far aside that the polynomial folds back there.
    """
    depth = points_c[:, 2]
    is_seen = depth > LEAST_DEPTH_M
    xy = points_c[:, :2] / np.where(is_seen, depth, np.nan)[:, None]
    xy[np.hypot(xy[:, 0], xy[:, 1]) >= fold_radius(lens)] = np.nan
    return _distorted(lens, xy) * (lens.fx_px, lens.fy_px) + (lens.cx_px, lens.cy_px)


def rays(lens: Lens, pixels: Array) -> Array:
    """Return the directions in which pixels look, with depth 1.  (n, 2) px -> (n, 3)

    Newton's method on the distortion; NaN for a pixel that no direction below the fold leads to.
    """
    aim = (pixels - (lens.cx_px, lens.cy_px)) / (lens.fx_px, lens.fy_px)
    limit = fold_radius(lens)
    xy = _within(aim, limit)
    for _ in range(N_NEWTON):
        miss = _distorted(lens, xy) - aim
        J = ray_jacobian(lens, xy)
        det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
        det = np.where(np.abs(det) < CONVERGED, np.nan, det)
        step = np.stack(
            [
                J[:, 1, 1] * miss[:, 0] - J[:, 0, 1] * miss[:, 1],
                J[:, 0, 0] * miss[:, 1] - J[:, 1, 0] * miss[:, 0],
            ],
            axis=1,
        )
        step /= det[:, None]
        xy = _within(xy - step, limit)
        if not (np.abs(step) > STILL).any():
            break
    error = np.abs(_distorted(lens, xy) - aim).max(axis=1)
    is_found = (error < 1e-9) & (np.hypot(xy[:, 0], xy[:, 1]) < limit)
    return np.column_stack([np.where(is_found[:, None], xy, np.nan), np.ones(len(xy))])


def intersect_height(T_bc: Array, directions_c: Array, height_m: float) -> Array:
    """Return where rays of a camera meet the plane z = height of the base frame.  (4, 4), (n, 3), m -> (n, 3) m

    NaN where a ray runs along the plane or meets it behind the camera.
    """
    directions_b = directions_c @ T_bc[:3, :3].T
    eye = T_bc[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (height_m - eye[2]) / directions_b[:, 2]
    reach = np.where(np.isfinite(reach) & (reach > 0.0), reach, np.nan)
    points = eye + reach[:, None] * directions_b
    points[np.isfinite(reach), 2] = height_m
    return points


def ray_jacobian(lens: Lens, xy: Array) -> Array:
    """Return how distorted coordinates change with undistorted ones.  (n, 2) -> (n, 2, 2)"""
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    slope = 2.0 * (lens.k1 + r2 * (2.0 * lens.k2 + 3.0 * r2 * lens.k3))
    cross = x * y * slope + 2.0 * (lens.p1 * x + lens.p2 * y)
    J = np.empty((len(xy), 2, 2))
    J[:, 0, 0] = radial + x * x * slope + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x
    J[:, 1, 1] = radial + y * y * slope + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x
    J[:, 0, 1] = J[:, 1, 0] = cross
    return J


@functools.lru_cache(maxsize=64)
def fold_radius(lens: Lens) -> float:
    """Return the undistorted radius from which on the radial polynomial falls again; infinite where it never does.

    d/dr (r + k1 r^3 + k2 r^5 + k3 r^7) = 0, solved for 1 / r^2, so that small coefficients do no harm.
    """
    roots = np.roots([1.0, 3.0 * lens.k1, 5.0 * lens.k2, 7.0 * lens.k3])
    real = [root.real for root in roots if abs(root.imag) < 1e-9 and root.real > LEAST_CURVE]
    return float(1.0 / np.sqrt(max(real))) if real else float("inf")


def _distorted(lens: Lens, xy: Array) -> Array:
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    return np.stack(
        [
            x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
            y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y,
        ],
        axis=1,
    )


def _within(xy: Array, limit: float) -> Array:
    """Return points, those at or beyond a radius drawn back just inside it."""
    if not np.isfinite(limit):
        return xy
    radius = np.hypot(xy[:, 0], xy[:, 1])
    inside = limit * (1.0 - 1e-6)
    share = np.where(radius > inside, inside / np.maximum(radius, CONVERGED), 1.0)
    return xy * share[:, None]
