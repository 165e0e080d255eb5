"""What an expert remembers: a ring of normalised P's with the utility they turned out to have."""

from typing import Any

import numpy as np

__all__ = ["Replay"]

Array = np.ndarray


class Replay:
    """The newest rows, up to a capacity."""

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
