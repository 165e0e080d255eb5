"""Where points of the arm would be at given joints, by the physics' own kinematics: what a set-point asks of them."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.plant import TwinWorld

__all__ = ["Points", "elbow_offset"]

Array = NDArray[np.float64]
UPPER_ARM, FOREARM = "link_2", "link_3"


def elbow_offset(model: mujoco.MjModel) -> Array:
    """Return the elbow in the forearm's frame: where the upper arm's own body ends on the joint between the two.

    The frames' common origin is a construction of the arm's parameters, beside the arm: nothing of it is there, and
    as the base turns it may be faster than the elbow or slower.  () -> (3,)
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    upper, fore = model.body(UPPER_ARM).id, model.body(FOREARM).id
    origin, frame = data.xpos[fore], data.xmat[fore].reshape(3, 3)
    ends = [np.zeros(3)]
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom] == upper and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            along = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
            ends += [frame.T @ (data.geom_xpos[geom] + side * along - origin) for side in (-1.0, 1.0)]
    return min(ends[1:] or ends, key=lambda end: float(np.linalg.norm(end)))


class Points:
    """Tool centre point, flange and elbow of one world's arm."""

    def __init__(self, world: TwinWorld) -> None:
        self._model, self._data = world.model, mujoco.MjData(world.model)
        self._tcp, self._flange = (world.model.site(name).id for name in ("tcp", "flange"))
        self._elbow, self._offset = world.model.body(FOREARM).id, elbow_offset(world.model)

    def speeds(self, q_rad: Array, dt_s: float) -> Array:
        """Return how fast each point goes along joints that are dt apart.  (n, 6) -> (n - 1, 3)"""
        placed = np.empty((len(q_rad), 3, 3))
        model, data = self._model, self._data
        for k, q in enumerate(q_rad):
            data.qpos[:6] = q
            mujoco.mj_kinematics(model, data)
            placed[k, 0], placed[k, 1] = data.site_xpos[self._tcp], data.site_xpos[self._flange]
            placed[k, 2] = data.xpos[self._elbow] + data.xmat[self._elbow].reshape(3, 3) @ self._offset
        return np.linalg.norm(np.diff(placed, axis=0), axis=2) / dt_s
