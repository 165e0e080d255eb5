"""Candidate moves: what the arm could do in the next time step."""

import math

import numpy as np

from config.learning import Actions
from robot.messages import Heading, StationSpec

__all__ = ["Candidates", "heading_of"]

Array = np.ndarray


class Candidates:
    """The paper's action, a direction of movement and a height, on a grid that a learner may turn."""

    def __init__(self, spec: StationSpec, actions: Actions) -> None:
        angles = np.arange(actions.n_headings) * (2.0 * math.pi / actions.n_headings)
        shares = np.array(actions.distance_shares)
        lengths = np.repeat(shares * spec.max_step_m, actions.n_headings)
        bearings = np.tile(angles, len(shares))
        rows = [np.zeros((1, 3))]
        rows.append(np.column_stack([lengths * np.cos(bearings), lengths * np.sin(bearings), np.zeros_like(lengths)]))
        level = np.concatenate(rows)
        self._asked = np.concatenate([level + np.array([0.0, 0.0, height]) for height in spec.heights_m[::-1]])

    def asked(self, turn: float = 0.0) -> Array:
        """Return the candidates as displacements in the plane and heights over the table.

        Args:
            turn: By how much of the grid's angle all headings are turned, in [0, 1).

        Returns:
            Metres, (k, 3); the first half at travel height, the second at the lowest; each begins with staying put.
        """
        return self._asked if turn == 0.0 else self._turned(turn)

    def _turned(self, turn: float) -> Array:
        angle = turn * 2.0 * math.pi
        cos, sin = math.cos(angle), math.sin(angle)
        asked = self._asked.copy()
        asked[:, 0] = cos * self._asked[:, 0] - sin * self._asked[:, 1]
        asked[:, 1] = sin * self._asked[:, 0] + cos * self._asked[:, 1]
        return asked


def heading_of(asked: Array) -> Heading:
    """Return a row of asked moves as an intent.  (3,) -> Heading"""
    x, y, height = asked.tolist()
    return Heading(heading_rad=math.atan2(y, x), distance_m=math.hypot(x, y), height_m=height)
