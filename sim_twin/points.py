"""Where points of the arm would be at given joints, by the physics' own kinematics: what a set-point asks of them."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.plant import TwinWorld

__all__ = ["Points"]

Array = NDArray[np.float64]


class Points:
    """Tool centre point, flange and elbow of one world's arm."""

    def __init__(self, world: TwinWorld) -> None:
        self._model, self._data = world.model, mujoco.MjData(world.model)
        self._tcp, self._flange = (world.model.site(name).id for name in ("tcp", "flange"))
        self._elbow = world.model.body("link_3").id

    def speeds(self, q_rad: Array, dt_s: float) -> Array:
        """Return how fast each point goes along joints that are dt apart.  (n, 6) -> (n - 1, 3)"""
        placed = np.empty((len(q_rad), 3, 3))
        model, data = self._model, self._data
        for k, q in enumerate(q_rad):
            data.qpos[:6] = q
            mujoco.mj_kinematics(model, data)
            placed[k, 0], placed[k, 1] = data.site_xpos[self._tcp], data.site_xpos[self._flange]
            placed[k, 2] = data.xpos[self._elbow]
        return np.linalg.norm(np.diff(placed, axis=0), axis=2) / dt_s
