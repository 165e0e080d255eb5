"""A percept as a row of numbers, and a row of numbers as an intent. Pure."""

import math

import numpy as np
from numpy.typing import NDArray

from learning.interfaces import GoalState
from robot.messages import Heading, Percept, StationSpec

__all__ = ["FARTHEST_M", "N_ACTIONS", "asked", "intent_of", "is_achieved", "n_observed", "observed", "one_goal"]

FARTHEST_M = 3.0
"""Distances and places are told up to this; a UR5e's table ends far before it."""
N_ACTIONS = 3
N_TOOL, N_HAND = 3, 4
Row = NDArray[np.float32]


def n_observed(spec: StationSpec) -> int:
    """Return how many numbers `observed` makes of a percept."""
    return 2 * (spec.n_distances + spec.n_buttons) + N_TOOL + N_HAND


def observed(percept: Percept) -> Row:
    """Return P(t), which of it is valid, where the tool is, and what the hand and the contact tell.  () -> (k,)"""
    grip = percept.grip
    numbers = (
        *(_near(distance) for distance in percept.distances_m),
        *percept.button_states,
        *percept.valid,
        *(_near(coordinate) for coordinate in percept.tcp_position_m),
        grip.opening_m,
        grip.is_moving,
        grip.has_object,
        percept.is_in_contact,
    )
    return np.array(numbers, dtype=np.float32)


def intent_of(action: np.ndarray, spec: StationSpec) -> Heading:
    """Return the paper's action: direction of movement and height of the arm.

    Args:
        action: displacement in the plane as shares of the longest step, and the height between lowest and travel
            height, each -1 to 1; a longer displacement than one step is one step long.  (3,)
        spec: of the station.

    Raises:
        ValueError: it is not three finite numbers.
    """
    if action.shape != (N_ACTIONS,) or not np.isfinite(action).all():
        raise ValueError(f"expected {N_ACTIONS} finite numbers, got {action}")
    x, y, height = (min(1.0, max(-1.0, float(share))) for share in action)
    lowest, highest = spec.heights_m
    return Heading(
        heading_rad=math.atan2(y, x),
        distance_m=min(1.0, math.hypot(x, y)) * spec.max_step_m,
        height_m=lowest + (highest - lowest) * (height + 1.0) / 2.0,
    )


def asked(state: GoalState) -> Row:
    """Return a goal-state as a row of 0 and 1.  () -> (n,)"""
    return np.array(state, dtype=np.float32)


def one_goal(goal: int, n_goals: int) -> Row:
    """Return a wanted goal as a row of 0 and one 1.  () -> (n,)"""
    return asked(tuple(i == goal for i in range(n_goals)))


def is_achieved(achieved: np.ndarray, desired: np.ndarray) -> np.ndarray:
    """Return whether all that is wanted was achieved; where nothing is wanted nothing was.  (..., n) -> (...)"""
    wanted = np.asarray(desired) > 0.5
    return np.asarray((~wanted | (np.asarray(achieved) > 0.5)).all(axis=-1) & wanted.any(axis=-1))


def _near(length_m: float) -> float:
    return min(FARTHEST_M, max(-FARTHEST_M, length_m))
