"""Exploration before there is something to exploit: go where P(t) would be unlike the recent past.

A wish is a place some way off, known only by the P that the forward model predicts there. It is kept for many time
steps, refined on the way, and given up when the arm has come down on it: up, across, down.
"""

import math
from enum import StrEnum
from typing import Any

import numpy as np

from config.learning import Novelty
from learning.forward_model import ForwardModel
from learning.networks import normalised
from robot.messages import Percept, StationSpec

__all__ = ["Curiosity", "NoveltyMemory"]

Array = np.ndarray


class NoveltyMemory:
    """The newest normalised P's; novelty is the distance to the nearest of them, the first `skip` entries left out."""

    def __init__(self, capacity: int, n_inputs: int, *, skip: int = 0) -> None:
        self._skip = skip
        n_inputs -= skip
        self._rows = np.zeros((capacity, n_inputs), dtype=np.float32)
        self._squares = np.zeros(capacity, dtype=np.float32)
        self._n = 0
        self._next = 0

    def add(self, x: Array) -> None:
        """Remember a P, forgetting the oldest when full.  (n_inputs,)"""
        x = x[self._skip :]
        self._rows[self._next] = x
        self._squares[self._next] = float(x @ x)
        self._next = (self._next + 1) % len(self._rows)
        self._n = min(len(self._rows), self._n + 1)

    def novelty(self, x: Array) -> Array:
        """Return how far each P is from the nearest one remembered; at first all is equally new.  (k, n) -> (k,)"""
        if self._n == 0:
            return np.ones(len(x), dtype=np.float32)
        x = x[:, self._skip :]
        rows, squares = self._rows[: self._n], self._squares[: self._n]
        nearest = (squares - 2.0 * (x @ rows.T)).min(axis=1) + np.einsum("ij,ij->i", x, x)
        return np.sqrt(np.maximum(nearest, 0.0))

    def state_dict(self) -> dict[str, Any]:
        """Return the rows held."""
        return {"rows": self._rows[: self._n].copy(), "next": self._next}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._n = len(state["rows"])
        self._rows[: self._n] = state["rows"]
        self._squares[: self._n] = np.array([float(x @ x) for x in self._rows[: self._n]])
        self._next = int(state["next"])


class _Phase(StrEnum):
    UP = "up"
    ACROSS = "across"
    DOWN = "down"


class Curiosity:
    """Wishes for places where P would be new, and goes there."""

    def __init__(
        self,
        config: Novelty,
        spec: StationSpec,
        *,
        forward: ForwardModel,
        memory: NoveltyMemory,
        scales_m: tuple[float, ...],
        rng: np.random.Generator,
    ) -> None:
        self._config = config
        self._spec = spec
        self._forward = forward
        self._memory = memory
        self._scales_m = scales_m
        self._rng = rng
        self._way = np.zeros(2)
        """Displacement in the plane that is still to go."""
        self._phase = _Phase.UP
        self._last: Array | None = None
        self._n_still = 0
        self.is_active = False

    def begin(self) -> None:
        """Forget the wish in hand."""
        self.is_active = False

    def act(self, percept: Percept) -> Array:
        """Return the next asked move, (3,): towards the wish, which is made anew when there is none."""
        low, high = self._spec.heights_m
        if not self.is_active:
            self._wish(percept)
        self._note_stillness(percept)
        self._advance(percept)
        if not self.is_active:
            self._wish(percept)
        if self._phase is _Phase.UP:
            return np.array([0.0, 0.0, high])
        self._refine(percept)
        longest = self._spec.max_step_m
        length = _length(self._way)
        stride = self._way * min(1.0, longest / max(length, 1e-9))
        if self._phase is _Phase.ACROSS:
            self._way = self._way - stride
            return np.array([*stride, high])
        stride = stride * 0.35
        self._way = self._way - stride * 0.33
        return np.array([*stride, low])

    def _wish(self, percept: Percept) -> None:
        """Choose the newest of many places around by a softmax over their novelty."""
        n, reach = self._config.wishes, self._config.reach_m
        bearing = self._rng.uniform(0.0, 2.0 * np.pi, n)
        radius = reach * np.sqrt(self._rng.uniform(0.0, 1.0, n))
        ways = np.column_stack([radius * np.cos(bearing), radius * np.sin(bearing)])
        novelty = self._novelty_at(ways, percept)
        gain = np.exp((novelty - novelty.max()) / self._config.temperature)
        self._way = ways[int(self._rng.choice(n, p=gain / gain.sum()))]
        self._phase, self._last, self._n_still = _Phase.UP, None, 0
        self.is_active = True

    def _refine(self, percept: Percept) -> None:
        """Move the wish to a newer place close by, if there is one."""
        spread = 0.03 if self._phase is _Phase.ACROSS else 0.01
        ways = self._way + np.vstack([np.zeros((1, 2)), self._rng.normal(0.0, spread, (16, 2))])
        novelty = self._novelty_at(ways, percept)
        best = int(np.argmax(novelty))
        if novelty[best] > novelty[0] + 0.01:
            self._way = ways[best]

    def _novelty_at(self, ways: Array, percept: Percept) -> Array:
        asked = np.column_stack([ways, np.full(len(ways), self._spec.heights_m[0])])
        return self._memory.novelty(self._seen(asked, percept))

    def _seen(self, asked: Array, percept: Percept) -> Array:
        distances = self._forward.predict(asked, is_far=True)
        return normalised(distances, np.array(percept.button_states), self._scales_m)

    def _note_stillness(self, percept: Percept) -> None:
        now = np.array(percept.distances_m)
        is_still = self._last is not None and float(np.abs(now - self._last).max()) < self._config.still_m
        self._n_still = self._n_still + 1 if is_still else 0
        self._last = now

    def _advance(self, percept: Percept) -> None:
        """Go on to the next phase when the one in hand has come to its end."""
        if self._phase is _Phase.UP and (self._n_still >= 2 or self._is_up(percept)):
            self._phase, self._n_still = _Phase.ACROSS, 0
        elif self._phase is _Phase.ACROSS and (_length(self._way) < 0.004 or self._n_still >= 3):
            self._phase, self._n_still = _Phase.DOWN, 0
        elif self._phase is _Phase.DOWN and self._n_still >= 3:
            self._give_up(percept)

    def _is_up(self, percept: Percept) -> bool:
        """Whether going up would change nothing any more."""
        up = self._forward.predict(np.array([[0.0, 0.0, self._spec.heights_m[1]]]))[0]
        return float(np.abs(up - np.array(percept.distances_m)).max()) < 0.02

    def _give_up(self, percept: Percept) -> None:
        """The wish has come true or it cannot: in both cases it is not new any more."""
        asked = np.array([[*self._way, self._spec.heights_m[0]]])
        self._memory.add(self._seen(asked, percept)[0])
        now = np.array([percept.distances_m])
        self._memory.add(normalised(now, np.array(percept.button_states), self._scales_m)[0])
        self.is_active = False


def _length(way: Array) -> float:
    """Return the length of a displacement in the plane.  (2,) -> ()"""
    return math.hypot(float(way[0]), float(way[1]))
