"""What a pose's uncertainty makes of points of the table. Pure maths."""

import numpy as np

from perception.calibration.lens import Array, Lens, intersect_height, project, rays
from perception.calibration.poses import carried, inverse, rotation, transform

__all__ = ["expected_plane_error_m", "grid_on_table", "nudged"]

N_GRID = 7
STEP = 1e-6


def nudged(T_bc: Array, step: Array) -> Array:
    """Return a pose turned and moved a little in its own frame.  (4, 4), (6,) rad and m -> (4, 4)"""
    return T_bc @ transform(rotation(step[:3]), step[3:])


def grid_on_table(low_m: tuple[float, ...], high_m: tuple[float, ...], height_m: float) -> Array:
    """Return points spread evenly over a rectangle at one height.  -> (n, 3) m"""
    x, y = np.meshgrid(np.linspace(low_m[0], high_m[0], N_GRID), np.linspace(low_m[1], high_m[1], N_GRID))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, height_m)], axis=1)


def expected_plane_error_m(lens: Lens, T_bc: Array, covariance: Array, points_b: Array) -> float:
    """Return the error of points seen on their plane, rms over those in the picture, to first order.

    Args:
        lens: the camera's lens.
        T_bc: the camera in the base frame.
        covariance: of `nudged`'s step.  (6, 6)
        points_b: points of one height.  (n, 3) m
    """
    pixels = project(lens, carried(inverse(T_bc), points_b))
    is_in = (pixels >= 0.0).all(axis=1) & (pixels <= (lens.width_px - 1, lens.height_px - 1)).all(axis=1)
    directions = rays(lens, pixels[is_in])
    height = float(points_b[0, 2])
    columns = []
    for i in range(6):
        step = np.zeros(6)
        step[i] = STEP
        ahead = intersect_height(nudged(T_bc, step), directions, height)
        behind = intersect_height(nudged(T_bc, -step), directions, height)
        columns.append((ahead - behind)[:, :2] / (2.0 * STEP))
    slope = np.stack(columns, axis=2)  # (n, 2, 6)
    squares = np.einsum("nik,kl,nil->n", slope, covariance, slope)
    return float(np.sqrt(squares.mean())) if len(squares) else float("inf")
