"""Where the twin's cameras stand and what their lenses are like. Data and maths."""

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.lens import TrueLens, bent_pixels

__all__ = ["RIG_VIEW", "SERVED_VIEW", "STUDIO_VIEW", "View", "looking", "nudged"]

Array = NDArray[np.float64]
EYE_M, TARGET_M = (0.98, 0.04, 1.16), (0.435, 0.0, 0.0)
"""Before the table, opposite the arm, 65 degrees above it: over the leaves of open lids one sees into the boxes."""


class View(msgspec.Struct, frozen=True, kw_only=True):
    """One camera: its lens, its place, and how finely it is drawn."""

    name: str
    lens: TrueLens
    eye_m: tuple[float, float, float] = EYE_M
    target_m: tuple[float, float, float] = TARGET_M
    shadow_px: int = 2048
    offsamples: int = 4
    """Samples a drawn pixel, against jagged edges."""
    n_stacks: int = 16
    """Rings that a round shape is drawn of, from one end to the other."""

    def set_quality(self, model: mujoco.MjModel) -> None:
        """Have a model's world drawn as finely as this says, by what draws it from now on."""
        quality = model.vis.quality
        quality.shadowsize = min(quality.shadowsize, self.shadow_px)
        quality.offsamples, quality.numstacks = self.offsamples, self.n_stacks

    @property
    def T_bc(self) -> Array:
        """Where the camera is.  -> (4, 4)"""
        return looking(self.eye_m, self.target_m)

    def seen_at(self, points_m: Array) -> Array:
        """Return the pixels of points of the base frame that are before the camera.  (n, 3) m -> (n, 2) px"""
        T = self.T_bc
        local = (points_m - T[:3, 3]) @ T[:3, :3]
        return bent_pixels(self.lens, local[:, :2] / local[:, 2:])


STUDIO_VIEW = View(
    name="front",
    lens=TrueLens(
        width_px=1280, height_px=720, focal_px=(918.0, 921.0), centre_px=(652.3, 351.8),
        radial=(-0.11, 0.06), tangential=(0.0011, -0.0007),
    ),
)  # fmt: skip
"""What single pictures are taken with: wide, 720 rows."""
RIG_VIEW = View(
    name="table",
    lens=TrueLens(
        width_px=640, height_px=480, focal_px=(776.0, 778.5), centre_px=(326.4, 236.1),
        radial=(-0.09, 0.05), tangential=(0.0008, -0.0011),
    ),
    shadow_px=1024, offsamples=0,
)  # fmt: skip
"""What a rig looks through, twenty times a second: 45 degrees wide, so that the table fills the picture."""
SERVED_VIEW = msgspec.structs.replace(RIG_VIEW, shadow_px=256, n_stacks=4)
"""The same, drawn in half the time where the world goes on meanwhile: shadows have coarser edges, domes fewer rings."""


def looking(eye_m: tuple[float, float, float], target_m: tuple[float, float, float]) -> Array:
    """Return T_bc of a camera that looks at a point, up being up.  -> (4, 4)"""
    ahead = np.subtract(target_m, eye_m)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    down = np.cross(ahead, right)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([axis / np.linalg.norm(axis) for axis in (right, down, ahead)])
    T[:3, 3] = eye_m
    return T


def nudged(T_bc: Array, turn_rad: Array, shift_m: Array) -> Array:
    """Return a camera turned a little about its own axes and shifted.  (4, 4), (3,), (3,) -> (4, 4)"""
    x, y, z = turn_rad
    small = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    left, _, right = np.linalg.svd(np.eye(3) + small)
    T = T_bc.copy()
    T[:3, :3], T[:3, 3] = T_bc[:3, :3] @ (left @ right), T_bc[:3, 3] + shift_m
    return T
