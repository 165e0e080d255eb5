"""Where the elbow of an arm is, by the physics' own shapes."""

import mujoco
import numpy as np
from numpy.typing import NDArray

__all__ = ["elbow_offset"]

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
