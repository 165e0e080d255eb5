"""Where an arm would be that is where its set-points ask it to be, by the physics' own kinematics."""

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.plant import TwinWorld
from sim_twin.points import elbow_offset
from sim_twin.recorder import OWN, Course, Placed, part_kinds

__all__ = ["Posed", "Postures"]

Array = NDArray[np.float64]


class Posed(msgspec.Struct, frozen=True, kw_only=True):
    """Where an arm would be that is where it was asked to be, and everything else where it is."""

    points_m: Array
    """(ticks, 3, 3) tool centre point, flange and elbow"""
    placed: Placed

    def speeds(self, dt_s: float) -> Array:
        """Return how fast each point goes from tick to tick.  () -> (ticks - 1, 3)"""
        return np.linalg.norm(np.diff(self.points_m, axis=0), axis=2) / dt_s


class Postures:
    """Tool centre point, flange and elbow of one world's arm, and its shapes."""

    def __init__(self, world: TwinWorld) -> None:
        self._model, self._data = world.model, mujoco.MjData(world.model)
        self._tcp, self._flange = (world.model.site(name).id for name in ("tcp", "flange"))
        self._elbow, self._offset = world.model.body("link_3").id, elbow_offset(world.model)
        self._own = np.flatnonzero([kind in OWN for kind in part_kinds(world)])
        self._fingers = world.finger_addresses

    def along(self, course: Course) -> Posed:
        """Return where set-points would bring points and shapes of the arm, tick by tick, the fingers as they are."""
        model, data, q_rad = self._model, self._data, course.set_point_rad
        n = len(q_rad)
        points, at, turned = np.empty((n, 3, 3)), course.placed.at_m.copy(), course.placed.turned.copy()
        own, half_m = self._own, course.opening_m[course.n_substeps - 1 :: course.n_substeps] / 2.0
        for k, q in enumerate(q_rad):
            data.qpos[:6] = q
            data.qpos[self._fingers] = half_m[k]
            mujoco.mj_kinematics(model, data)
            points[k, 0], points[k, 1] = data.site_xpos[self._tcp], data.site_xpos[self._flange]
            points[k, 2] = data.xpos[self._elbow] + data.xmat[self._elbow].reshape(3, 3) @ self._offset
            at[k, own], turned[k, own] = data.geom_xpos[own], data.geom_xmat[own]
        return Posed(points_m=points, placed=Placed(at_m=at, turned=turned))
