"""How far the arm is from itself, the table and what stands on it, and where it would get nearer."""

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.scenario import Scenario
from robot.messages import Vec6
from robot.safety.collision_model import PALM, PALM_BALL, Hard, Pair, blocks_of, collision_model

__all__ = ["Clearance", "Closest"]

REACH_M = 0.08
"""Farther things are not looked at: twice as far costs twice the time."""


class Closest(msgspec.Struct, frozen=True, kw_only=True):
    """One pair within reach."""

    pair: Pair
    gap_m: float
    """Distance beyond what the pair keeps."""
    slope_m_rad: Vec6
    """Change of the gap for a turn of each joint."""


class Clearance:
    """Distances of one arm at one table, by MuJoCo's collision pass on shapes alone. Memory: its scratch space.

    Attributes:
        most_m: No gap is told greater than this.
    """

    def __init__(self, arm: ArmConfig, scenario: Scenario, *, hard: Hard, reach_m: float = REACH_M) -> None:
        self._model, self._pairs = collision_model(
            arm, table_m=scenario.table.height_m, blocks=blocks_of(scenario), hard=hard, reach_m=reach_m
        )
        model = self._model
        self._data = mujoco.MjData(model)
        self._hard, self._reach_m = hard, reach_m
        self.most_m = reach_m - max(hard.own_m, hard.table_m, hard.thing_m)
        self._palm, self._ball = model.geom(PALM).id, model.geom(PALM_BALL).id
        ends = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        self._pair_of = {frozenset(ab): pair for ab, pair in zip(ends, self._pairs, strict=True)}
        self._segment = np.zeros(6)
        self._tcp = model.site("tcp").id

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """What is looked at."""
        return self._pairs

    def gap(self, q_rad: Vec6) -> float:
        """Return the least distance beyond what each pair keeps, metres, `most_m` where everything is farther.

        Negative: nearer than is kept, as far as one shape is inside the other.
        """
        model, data = self._model, self._data
        data.qpos[:] = q_rad
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        n = data.ncon
        least = self.most_m
        if not n:
            return least
        contact = data.contact
        gaps = (contact.dist - contact.includemargin).tolist()
        firsts = contact.geom1.tolist()
        for k, gap in enumerate(gaps):
            if gap < least:
                if self._ball in (firsts[k], contact.geom2[k]):
                    gap = self._palm_gap(firsts[k], int(contact.geom2[k]))
                least = min(least, gap)
        return least

    def closest(self, q_rad: Vec6, *, within_m: float) -> list[Closest]:
        """Return every pair whose gap is at most so much, and how it changes with the joints."""
        self.gap(q_rad)
        model, data = self._model, self._data
        mujoco.mj_comPos(model, data)
        found: list[Closest] = []
        seen: set[tuple[int, int]] = set()
        for a, b in data.contact.geom.tolist():
            if (a, b) in seen:
                continue
            seen.add((a, b))
            pair = self._pair_of[frozenset((a, b))]
            one, two = (self._palm if g == self._ball else g for g in (a, b))
            distance = mujoco.mj_geomDistance(model, data, one, two, self._reach_m, self._segment)
            gap = distance - self._hard.of(pair.near)
            if gap <= within_m and 0.0 != distance < self._reach_m:
                found.append(Closest(pair=pair, gap_m=gap, slope_m_rad=self._slope(one, two, distance)))
        return found

    def tool_jacobian(self, q_rad: Vec6) -> NDArray[np.float64]:
        """Return the tool centre point's velocity and the tool's turning for a speed of each joint.  (6,) -> (6, 6)"""
        model, data = self._model, self._data
        data.qpos[:] = q_rad
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        J = np.zeros((6, 6))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], self._tcp)
        return J

    def _palm_gap(self, a: int, b: int) -> float:
        other = b if a == self._ball else a
        distance = mujoco.mj_geomDistance(self._model, self._data, self._palm, other, self._reach_m, None)
        return distance - self._hard.thing_m

    def _slope(self, one: int, two: int, distance: float) -> Vec6:
        """Return the gap's slope: the speed of the second nearest point away from the first, along their segment."""
        model, data = self._model, self._data
        start, end = self._segment[:3].copy(), self._segment[3:].copy()
        away = (end - start) / distance
        slope = np.zeros(6)
        jacobian = np.zeros((3, 6))
        for geom, point, sign in ((one, start, -1.0), (two, end, 1.0)):
            mujoco.mj_jac(model, data, jacobian, None, point, int(model.geom_bodyid[geom]))
            slope += sign * (away @ jacobian)
        x = slope.tolist()
        return x[0], x[1], x[2], x[3], x[4], x[5]
