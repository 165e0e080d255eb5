"""A calibrated camera as maths: points to pixels, pixels to points of a plane."""

import numpy as np

from perception.calibration.camera_file import CameraFile
from perception.calibration.lens import Array, Lens, intersect_height, rays
from perception.calibration.poses import inverse, matrix_of
from perception.detection.kernels import lens_numbers, on_plane, pixels_of
from perception.errors import PerceptionConfigError

__all__ = ["Eye"]

STEP_M = 1e-4


class Eye:
    """One camera's lens and place; stores, knows nothing of pictures.

    Raises:
        PerceptionConfigError: the file does not say where the camera stands.
    """

    def __init__(self, camera: CameraFile) -> None:
        if camera.extrinsics is None:
            raise PerceptionConfigError(
                f"camera {camera.name}: expected a place, came a lens alone; run `autotelic calibrate extrinsics`"
            )
        self.lens: Lens = camera.lens
        self.T_bc = matrix_of(camera.extrinsics.pose)
        self.T_cb = np.ascontiguousarray(inverse(self.T_bc))
        self.numbers = lens_numbers(camera.lens)
        x, y, _ = self.on_plane(np.array([[camera.lens.cx_px, camera.lens.cy_px]]), 0.0)[0].tolist()
        self._ahead = (x, y)

    @property
    def position_m(self) -> Array:
        """Where the camera is, base frame.  -> (3,)"""
        return self.T_bc[:3, 3]

    def pixels(self, points_b: Array) -> Array:
        """Return where points of the base frame are seen, NaN for what is behind.  (n, 3) m -> (n, 2) px"""
        return pixels_of(self.numbers, self.T_cb, np.ascontiguousarray(points_b))

    def on_plane(self, pixels: Array, height_m: float) -> Array:
        """Return where the pixels' rays meet the plane at a height.  (n, 2) px -> (n, 3) m"""
        return intersect_height(self.T_bc, rays(self.lens, pixels), height_m)

    def spot(self, u: float, v: float, height_m: float) -> Array:
        """Return where one pixel's ray meets the plane at a height, not numbers where it does not.  -> (3,) m"""
        x, y = on_plane(self.numbers, self.T_cb, u, v, (self._ahead[0], self._ahead[1], height_m))
        return np.array([x, y, height_m])

    def slope(self, point_b: Array) -> Array:
        """Return how a point's pixel moves with the point along x and y.  (3,) m -> (2, 2) px/m"""
        steps = point_b + STEP_M * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
        ahead_x, behind_x, ahead_y, behind_y = self.pixels(steps)
        return np.column_stack([ahead_x - behind_x, ahead_y - behind_y]) / (2.0 * STEP_M)
