"""How far the arm is from itself, the table and what stands on it, and where it would get nearer."""

from struct import Struct

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.scenario import Scenario
from robot.messages import Vec6
from robot.safety.blocks import Block
from robot.safety.collision_model import BALLS, THING_PREFIX, Hard, Pair, collision_model, put
from robot.safety.obstacles import blocks_of

__all__ = ["Clearance", "Closest"]

REACH_M = 0.08
"""Farther things are not looked at: twice as far costs twice the time."""
PUT_JOINTS = Struct("6d").pack_into
WORLD = 0
"""The body of what no joint moves."""


class Closest(msgspec.Struct, frozen=True, kw_only=True):
    """One pair within reach."""

    pair: Pair
    gap_m: float
    """Distance beyond what the pair keeps."""
    slope_m_rad: Vec6
    """Change of the gap for a turn of each joint."""


class Clearance:
    """Distances of one arm at one table, by MuJoCo's collision pass on shapes alone. Memory: where things stand.

    Attributes:
        most_m: No gap is told greater than this.
    """

    def __init__(self, arm: ArmConfig, scenario: Scenario, *, hard: Hard, reach_m: float = REACH_M) -> None:
        self._blocks = blocks_of(scenario)
        self._model, self._pairs = collision_model(
            arm, table_m=scenario.table.height_m, blocks=self._blocks, hard=hard, reach_m=reach_m
        )
        model = self._model
        self._things = [model.geom(THING_PREFIX + block.name).id for block in self._blocks]
        self._data = mujoco.MjData(model)
        self._q = memoryview(self._data.qpos)
        """The model's own joints, to be written to: at ticks of 2 ms asking for them each time takes 20 us."""
        self._hard, self._reach_m = hard, reach_m
        self.most_m = reach_m - max(hard.own_m, hard.table_m, hard.thing_m)
        self._box_of = {model.geom(ball).id: model.geom(box).id for box, ball in BALLS.items()}
        """The box that is asked in place of each ball."""
        ends = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        self._pair_of = {frozenset(ab): pair for ab, pair in zip(ends, self._pairs, strict=True)}
        self._kept_of = self._kept()
        self._segment = np.zeros(6)
        self._body_of = model.geom_bodyid.tolist()
        self._posed_rad: Vec6 | None = None
        self._tcp = model.site("tcp").id

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """What is looked at."""
        return self._pairs

    def put(self, blocks: tuple[Block, ...]) -> None:
        """Take things to be where they are now; their number and order never change."""
        for geom, before, block in zip(self._things, self._blocks, blocks, strict=True):
            if block is not before:
                put(self._model, geom, block)
        self._blocks, self._posed_rad = blocks, None

    def gap(self, q_rad: Vec6) -> float:
        """Return the least distance beyond what each pair keeps, metres, `most_m` where everything is farther.

        Negative: nearer than is kept, as far as one shape is inside the other.
        """
        self._pose(q_rad)
        model, data = self._model, self._data
        mujoco.mj_collision(model, data)
        n = data.ncon
        least = self.most_m
        if not n:
            return least
        contact, boxes, kept = data.contact, self._box_of, self._kept_of
        for distance, (a, b) in zip(contact.dist.tolist(), contact.geom.tolist(), strict=True):
            keep = kept[a, b]
            if distance - keep < least:
                if a in boxes or b in boxes:
                    a, b = boxes.get(a, a), boxes.get(b, b)
                    distance = mujoco.mj_geomDistance(model, data, a, b, self._reach_m, None)
                least = min(least, distance - keep)
        return least

    def closest(self, q_rad: Vec6, *, within_m: float) -> list[Closest]:
        """Return every pair whose gap is at most so much, and how it changes with the joints."""
        self._pose(q_rad)
        model, data = self._model, self._data
        mujoco.mj_collision(model, data)
        mujoco.mj_comPos(model, data)
        found: list[Closest] = []
        seen: set[tuple[int, int]] = set()
        for a, b in data.contact.geom.tolist():
            if (a, b) in seen:
                continue
            seen.add((a, b))
            pair = self._pair_of[frozenset((a, b))]
            one, two = self._box_of.get(a, a), self._box_of.get(b, b)
            distance = mujoco.mj_geomDistance(model, data, one, two, self._reach_m, self._segment)
            gap = distance - self._hard.of(pair.near)
            if gap <= within_m and 0.0 != distance < self._reach_m:
                found.append(Closest(pair=pair, gap_m=gap, slope_m_rad=self._slope(one, two, distance)))
        return found

    def tool_jacobian(self, q_rad: Vec6) -> NDArray[np.float64]:
        """Return the tool centre point's velocity and the tool's turning for a speed of each joint.  (6,) -> (6, 6)"""
        self._pose(q_rad)
        model, data = self._model, self._data
        mujoco.mj_comPos(model, data)
        J = np.zeros((6, 6))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], self._tcp)
        return J

    def _pose(self, q_rad: Vec6) -> None:
        """Bring every shape where it is for these joints, if it is not there already."""
        if q_rad != self._posed_rad:
            PUT_JOINTS(self._q, 0, *q_rad)
            mujoco.mj_kinematics(self._model, self._data)
            self._posed_rad = q_rad

    def _kept(self) -> dict[tuple[int, int], float]:
        """Return what each pair keeps, a contact's `includemargin`, by its shapes in either order."""
        model = self._model
        kept: dict[tuple[int, int], float] = {}
        ends = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        for (a, b), keep in zip(ends, model.pair_margin.tolist(), strict=True):
            kept[a, b] = kept[b, a] = keep
        return kept

    def _slope(self, one: int, two: int, distance: float) -> Vec6:
        """Return the gap's slope: the speed of the second nearest point away from the first, along their segment."""
        model, data = self._model, self._data
        start, end = self._segment[:3].copy(), self._segment[3:].copy()
        away = (end - start) / distance
        slope = np.zeros(6)
        jacobian = np.zeros((3, 6))
        for geom, point, sign in ((one, start, -1.0), (two, end, 1.0)):
            body = self._body_of[geom]
            if body != WORLD:
                mujoco.mj_jac(model, data, jacobian, None, point, body)
                slope += sign * (away @ jacobian)
        x = slope.tolist()
        return x[0], x[1], x[2], x[3], x[4], x[5]
