"""tool_contact: whether the tool met something, and how many slices ago it did."""

import numpy as np

from sim_twin.controller.motion.poses import Array, length

__all__ = ["ContactWatch"]

THRESHOLD_N = 12.0
"""UR does not publish its own; above the twin's noise-free reading of a carried object's weight."""
MOVING_M_S = 1e-3


class ContactWatch:
    """A history of what the tool felt.

    Args:
        n_slices: How far it reaches back.
        threshold_n: Force against the direction of motion that counts as contact.
    """

    def __init__(self, *, n_slices: int = 500, threshold_n: float = THRESHOLD_N) -> None:
        self._threshold_n = threshold_n
        self._n = n_slices
        self._felt = np.zeros((2 * n_slices, 3))
        """A ring, written twice: the last n slices are n rows on end, whatever place the next is written to."""
        self._next = 0
        self._speed = np.zeros(3)

    def push(self, force_n: Array, speed_m_s: Array) -> None:
        """Take in one slice: force of the world on the tool and the tool's speed, base axes.  (3,), (3,)"""
        self._felt[self._next] = self._felt[self._next + self._n] = force_n
        self._next = (self._next + 1) % self._n
        if length(speed_m_s) > MOVING_M_S:
            self._speed = np.array(speed_m_s)

    def slices_since_contact(self, direction: Array | None = None) -> int:
        """Return how many slices ago the tool met something in a direction; 0 without contact.

        Args:
            direction: Way the tool goes, base axes; its last motion where absent or zero.  (3,)
        """
        way = self._speed if direction is None or not np.any(direction) else np.asarray(direction)
        size = length(way)
        if size == 0.0:
            return 0
        against = -(self._felt[self._next : self._next + self._n] @ way) / size  # (n,), the oldest first
        free = np.flatnonzero(against < self._threshold_n)
        return self._n - 1 - int(free[-1]) if len(free) else self._n
