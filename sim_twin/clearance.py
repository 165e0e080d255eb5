"""Least distances between bodies over a whole course, by the physics' own geometry: spheres first, then exactly."""

import math
from collections.abc import Iterable

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.plant import TwinWorld
from sim_twin.readings import Reading
from sim_twin.recorder import OWN, Course, PartKind, Placed, part_kinds

__all__ = ["Clearances", "Nearest", "own_pairs", "scene_pairs"]

Array = NDArray[np.float64]
FARTHEST_M = 0.5
_CAPSULE, _PLANE = int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_PLANE)


class Nearest(msgspec.Struct, frozen=True, kw_only=True):
    """Where two bodies came nearest to each other."""

    distance_m: float
    """Negative where they overlap; FARTHEST_M where nothing was nearer."""
    tick: int = 0
    geoms: tuple[int, int] = (-1, -1)


def _solid(model: mujoco.MjModel, geom: int) -> bool:
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


def own_pairs(world: TwinWorld) -> list[tuple[int, int]]:
    """Return the pairs of the arm's own geoms that are not on the same body or on neighbouring ones."""
    model = world.model
    own = [i for i, kind in enumerate(part_kinds(world)) if kind in OWN and _solid(model, i)]
    links = {i: _link(model, i) for i in own}
    return [(a, b) for a in own for b in own if a < b and abs(links[a] - links[b]) > 2]


def _link(model: mujoco.MjModel, geom: int) -> int:
    """Return how far along the chain a geom is: link 1 to 6; hand and fingers belong to the sixth."""
    name = model.body(int(model.geom_bodyid[geom])).name
    return int(name.removeprefix("link_")) if name.startswith("link_") else 6


def scene_pairs(world: TwinWorld, allowed: Iterable[tuple[PartKind, PartKind]]) -> list[tuple[int, int]]:
    """Return pairs of a geom of the arm and a solid one of the scene that may not touch each other."""
    model, kinds, may = world.model, part_kinds(world), frozenset(allowed)
    own = [i for i, kind in enumerate(kinds) if kind in OWN and _solid(model, i)]
    others = [i for i, kind in enumerate(kinds) if kind not in OWN and _solid(model, i)]
    return [(a, b) for a in own for b in others if (kinds[a], kinds[b]) not in may]


class Clearances:
    """Least distance of a set of pairs over a course."""

    def __init__(self, world: TwinWorld, pairs: list[tuple[int, int]]) -> None:
        self._model, self._pairs = world.model, np.array(pairs, dtype=int).reshape(-1, 2)
        self._scratch = mujoco.MjData(world.model)
        model, first, second = world.model, self._pairs[:, 0], self._pairs[:, 1]
        is_capsule = model.geom_type[first] == _CAPSULE
        self._half = np.where(is_capsule, model.geom_size[first, 1], 0.0)
        self._radius = np.where(is_capsule, model.geom_size[first, 0], model.geom_rbound[first])
        self._other_radius = model.geom_rbound[second]
        self._is_plane = model.geom_type[second] == _PLANE

    def reading(self, limit: str, course: Course, placed: Placed, least_m: float, *, spare_m: Array) -> Reading:
        """Return the margin of the nearest pair to the least distance, as a share of that.

        Args:
            limit: what the reading is called.
            course: for its times.
            placed: where shapes are, tick by tick.
            least_m: what is to be kept.
            spare_m: (ticks,) added to all distances of a tick: what is no fault there.
        """
        near = self.nearest(placed, spare_m)
        if least_m <= 0.0:
            return Reading(limit=limit, share=math.inf if near.distance_m > 0.0 else -1.0, value=near.distance_m)
        names = [self._model.body(int(self._model.geom_bodyid[g])).name for g in near.geoms if g >= 0]
        return Reading(
            limit=limit, share=min(near.distance_m, FARTHEST_M) / least_m - 1.0, value=near.distance_m,
            at_s=near.tick * course.physics_s * course.n_substeps, detail=" to ".join(names),
        )  # fmt: skip

    def nearest(self, placed: Placed, spare_m: Array) -> Nearest:
        """Return where any of the pairs came nearest, each tick's distances longer by what is spared there."""
        if not len(self._pairs) or not len(placed.at_m):
            return Nearest(distance_m=FARTHEST_M)
        bound = self._lower_bounds(placed) + spare_m[:, None]
        best = Nearest(distance_m=FARTHEST_M)
        order = np.argsort(bound, axis=None)
        n_pairs = len(self._pairs)
        for flat in order.tolist():
            tick, pair = divmod(flat, n_pairs)
            if bound[tick, pair] >= best.distance_m:
                break
            a, b = self._pairs[pair].tolist()
            spare = float(spare_m[tick])
            distance = self._exact(placed, tick, a, b, best.distance_m - spare) + spare
            if distance < best.distance_m:
                best = Nearest(distance_m=distance, tick=tick, geoms=(a, b))
        return best

    def _lower_bounds(self, placed: Placed) -> Array:
        """Return a distance that each pair has at least, from segments and balls around them.  () -> (ticks, pairs)"""
        first, second = self._pairs[:, 0], self._pairs[:, 1]
        centre, other = placed.at_m[:, first], placed.at_m[:, second]
        axis = placed.turned[:, first][..., 2::3]  # third column: along a capsule
        apart = other - centre
        along = np.clip(np.einsum("tpi,tpi->tp", apart, axis), -self._half, self._half)
        ball = np.linalg.norm(apart - along[..., None] * axis, axis=2) - self._other_radius
        lowest = centre[..., 2] - self._half * np.abs(axis[..., 2]) - other[..., 2]
        return np.where(self._is_plane, lowest, ball) - self._radius

    def _exact(self, placed: Placed, tick: int, a: int, b: int, most_m: float) -> float:
        data = self._scratch
        data.geom_xpos[a], data.geom_xpos[b] = placed.at_m[tick, a], placed.at_m[tick, b]
        data.geom_xmat[a], data.geom_xmat[b] = placed.turned[tick, a], placed.turned[tick, b]
        return float(mujoco.mj_geomDistance(self._model, data, a, b, max(most_m, 1e-3), None))
