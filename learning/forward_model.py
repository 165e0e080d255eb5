"""Forward models: what would P(t+1) be after a move. This page holds the door and the given, geometric one."""

from importlib import import_module
from typing import Any, Protocol

import numpy as np

from config.learning import ForwardModel as ForwardModelConfig
from robot.messages import Heading, Percept, StationSpec, StepResult, Vec3

__all__ = ["TABLE", "ForwardModel", "GeometricModel", "make_forward_model", "shaped"]

Array = np.ndarray
MODELS = {
    "geometric": "learning.forward_model:GeometricModel",
    "learned": "learning.learned_forward:LearnedModel",
}
TABLE = "table"
CARRIED_WITHIN_M = 0.05
"""A hand that reports an object carries the nearest one, if it is this near the tool centre point."""


class ForwardModel(Protocol):
    """Predicts the distances of P after a move; states are predicted to stay."""

    def begin(self, percept: Percept) -> None:
        """Start from a percept. What the last step left is kept if this is the percept it ended with."""
        ...

    def predict(self, asked: Array, *, is_far: bool = False) -> Array:
        """Return the distances once the arm has come to rest on the move.

        Args:
            asked: Displacement in the plane and height over the table, metres, (k, 3).
            is_far: The move may take many time steps; else it is what one time step makes of it.

        Returns:
            d_1..d_n, metres, (k, n).
        """
        ...

    def observe(self, intent: Heading, result: StepResult, *, is_learning: bool) -> None:
        """Take in what an intent came to."""
        ...

    def train(self) -> None:
        """Learn from what was observed."""
        ...

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        ...

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        ...


def shaped(asked: Array, height_m: float, max_step_m: float) -> Array:
    """Return what one time step makes of asked moves: straight towards them, no longer than the longest step.

    Args:
        asked: Displacement in the plane and height over the table, metres, (k, 3).
        height_m: Height of the target now.
        max_step_m: Longest step.

    Returns:
        Displacement of the target, metres, (k, 3).
    """
    moves = asked.copy()
    moves[:, 2] -= height_m
    length = np.sqrt(np.einsum("ij,ij->i", moves, moves))
    moves *= (max_step_m / np.maximum(length, max_step_m))[:, None]
    return moves


class GeometricModel:
    """Given knowledge: where things are (from the percept) and where the arm will come to rest (its target)."""

    def __init__(self, config: ForwardModelConfig, spec: StationSpec, rng: np.random.Generator) -> None:
        del config, rng  # nothing to set, nothing to draw
        self._spec = spec
        low, high = np.array(spec.workspace_m)
        self._low, self._high = low, high
        self._table = np.array([name == TABLE for name in spec.distance_names])
        self._rows: dict[tuple[str, ...], list[int]] = {}
        self._target = np.zeros(3)
        self._stride = spec.max_step_m
        """How far one time step really carried the target last: less near the table."""
        self._percept: Percept | None = None

    def begin(self, percept: Percept) -> None:
        """Start from a percept: the target is where the tool is, unless the arm is still on its way."""
        if percept is not self._percept:
            self._target = np.array(percept.tcp_position_m)
            self._stride = self._spec.max_step_m
        self._percept = percept

    def predict(self, asked: Array, *, is_far: bool = False) -> Array:
        """Return the distances from where the target would be; what the hand carries stays as near as it is."""
        percept = self._percept
        assert percept is not None, "begin() comes first"
        table_z = self._spec.table_height_m
        if is_far:
            places = asked + np.array([self._target[0], self._target[1], table_z])
        else:
            places = self._target + shaped(asked, self._target[2] - table_z, self._stride)
        np.clip(places, self._low, self._high, out=places)
        distances = _between(places, self._objects(percept))
        distances[:, self._table] = (places[:, 2] - table_z)[:, None]
        carried = _carried(percept, self._table)
        if carried is not None:
            distances[:, carried] = percept.distances_m[carried]
        return distances

    def observe(self, intent: Heading, result: StepResult, *, is_learning: bool) -> None:
        """Remember where the target is, and how far a step carried it."""
        del is_learning  # nothing here is learnt
        target = np.array(result.executed.target_m)
        longest = self._spec.max_step_m
        rise = intent.height_m + self._spec.table_height_m - self._target[2]
        asked = min(longest, float(np.hypot(intent.distance_m, rise)))
        if asked > 0.5 * longest:
            share = float(np.linalg.norm(target - self._target)) / asked
            self._stride = longest * min(1.0, max(0.3, share))
        self._target = target
        self._percept = result.percept

    def train(self) -> None:
        """There is nothing to learn."""

    def state_dict(self) -> dict[str, Any]:
        """Nothing is learnt."""
        return {}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Nothing is learnt."""

    def _objects(self, percept: Percept) -> Array:
        """Return the position of each distance entry's thing, zeros for the table.  -> (n, 3)"""
        names = tuple(thing.name for thing in percept.objects)
        rows = self._rows.get(names)
        if rows is None:
            rows = [names.index(name) if name != TABLE else -1 for name in self._spec.distance_names]
            self._rows[names] = rows
        positions: list[Vec3] = [thing.position_m for thing in percept.objects]
        positions.append((0.0, 0.0, 0.0))
        return np.array([positions[row] for row in rows])


def _between(places: Array, things: Array) -> Array:
    """Return the distance of each place from each thing, (k, 3), (n, 3) -> (k, n).

    |a - b|^2 = |a|^2 - 2 a.b + |b|^2: a third of the time of the offsets, and 1e-8 m off at the worst.
    """
    squares = np.einsum("ij,ij->i", places, places)[:, None] - 2.0 * (places @ things.T)
    squares += np.einsum("ij,ij->i", things, things)
    return np.sqrt(np.maximum(squares, 0.0, out=squares), out=squares)


def _carried(percept: Percept, is_table: Array) -> int | None:
    """Return the distance entry of the object in the hand, or None."""
    if not percept.grip.has_object:
        return None
    distances = np.where(is_table, np.inf, percept.distances_m)
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] < CARRIED_WITHIN_M else None


def make_forward_model(config: ForwardModelConfig, spec: StationSpec, rng: np.random.Generator) -> ForwardModel:
    """Return the configured forward model; the generator is for the learned one's weights and batches."""
    module, name = MODELS[config.kind].split(":")
    return getattr(import_module(module), name)(config, spec, rng)
