"""What is remembered to learn from: rings that forget the oldest."""

from typing import Any

import numpy as np

__all__ = ["Replay", "Samples"]

Array = np.ndarray


class Replay:
    """The newest normalised P's with the utility they turned out to have, up to a capacity."""

    def __init__(self, capacity: int, n_inputs: int) -> None:
        self.x = np.zeros((capacity, n_inputs), dtype=np.float32)
        self.y = np.zeros(capacity, dtype=np.float32)
        self.n = 0
        """Rows held."""
        self._next = 0

    def add(self, x: Array, y: Array) -> None:
        """Add rows, the oldest go.  x (k, n_inputs), y (k,)"""
        rows = (self._next + np.arange(len(x))) % len(self.x)
        self.x[rows], self.y[rows] = x, y
        self._next = (self._next + len(x)) % len(self.x)
        self.n = min(len(self.x), self.n + len(x))

    def state_dict(self) -> dict[str, Any]:
        """Return the rows held."""
        return {"x": self.x[: self.n].copy(), "y": self.y[: self.n].copy(), "next": self._next}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self.n = len(state["y"])
        self.x[: self.n], self.y[: self.n] = state["x"], state["y"]
        self._next = int(state["next"])


class Samples:
    """The newest samples of named float32 arrays, up to a capacity."""

    def __init__(self, capacity: int, shapes: dict[str, tuple[int, ...]]) -> None:
        self._arrays = {name: np.zeros((capacity, *shape), dtype=np.float32) for name, shape in shapes.items()}
        self._capacity = capacity
        self.n = 0
        """Samples held."""
        self._next = 0

    def add(self, **sample: Array) -> None:
        """Add one sample, the oldest goes."""
        for name, array in self._arrays.items():
            array[self._next] = sample[name]
        self._next = (self._next + 1) % self._capacity
        self.n = min(self._capacity, self.n + 1)

    def draw(self, n: int, rng: np.random.Generator) -> dict[str, Array]:
        """Return n samples drawn with replacement, stacked."""
        rows = rng.integers(0, self.n, n)
        return {name: array[rows] for name, array in self._arrays.items()}

    def state_dict(self) -> dict[str, Any]:
        """Return the samples held."""
        return {"arrays": {name: array[: self.n].copy() for name, array in self._arrays.items()}, "next": self._next}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        for name, array in self._arrays.items():
            self.n = len(state["arrays"][name])
            array[: self.n] = state["arrays"][name]
        self._next = int(state["next"])
