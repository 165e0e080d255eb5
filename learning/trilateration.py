"""Bearings from distances: how the tool moved and where things are, told from how distances changed. Pure."""

import numpy as np

__all__ = ["bearings", "comes_along", "share_moved"]

Array = np.ndarray

DOUBT, LEAST_DOUBT_M2 = 0.05, 1e-6
"""Weight of a guessed bearing against displacements squared and summed."""
FADE = 6.0
"""Time steps after which the past has lost three quarters of its weight."""
MARGIN_M = 0.01
LEAST_MOVE_M = 0.002
MOST_SEEN = 0.9
"""Share of a displacement that the greatest change of a distance usually shows."""


def bearings(x: Array, d_then: Array, d_now: Array, guess: Array) -> Array:
    """Return o, the displacement from the tool to each thing, by least squares.

    |o - x|^2 = d_then^2 and |o|^2 = d_now^2 give x.o = (d_now^2 + |x|^2 - d_then^2) / 2, linear in o. An error of x is
    worth the more the further off the thing is, so the guess weighs DOUBT * d_now^2; what lies k time steps back weighs
    1 / (1 + k / FADE)^2.

    Args:
        x: Displacements from the tool to where it was, metres, the newest last, (t, 3).
        d_then: Distances from there, (t, n).
        d_now: Distances, (n,).
        guess: What o is drawn towards, (n, 3).

    Returns:
        Metres, (n, 3).
    """
    y = 0.5 * (d_now**2 + np.einsum("ij,ij->i", x, x)[:, None] - d_then**2)
    weighted = x * (1.0 / (1.0 + np.arange(len(x), 0, -1) / FADE) ** 2)[:, None]
    doubt = DOUBT * d_now**2 + LEAST_DOUBT_M2
    normal = weighted.T @ x + doubt[:, None, None] * np.eye(3)
    return np.linalg.solve(normal, ((weighted.T @ y).T + doubt[:, None] * guess)[..., None])[..., 0]


def share_moved(expected: Array, d_before: Array, d_now: Array) -> float:
    """Return what share of an expected displacement was made, in [0, 1]: no distance changed more than the tool moved.

    Things lie all around, so the greatest change is close to the displacement, wherever it went.

    Args:
        expected: Displacement expected, metres, (3,).
        d_before: Distances of things at rest before, (n,).
        d_now: Distances after, (n,).
    """
    size = float(np.sqrt(expected @ expected))
    if size < LEAST_MOVE_M or not len(d_now):
        return 1.0
    return min(1.0, float(np.abs(d_now - d_before).max()) / (MOST_SEEN * size))


def comes_along(x: Array, d_then: Array, d_now: Array) -> Array:
    """Return which things moved with the hand: the triangle inequality |x| <= d_then + d_now forbids that they rested.

    Args:
        x: Displacements from the tool to where it was, metres, (t, 3).
        d_then: Distances from there, (t, n).
        d_now: Distances, (n,).
    """
    length = np.sqrt(np.einsum("ij,ij->i", x, x))[:, None]
    return (length > d_then + d_now + MARGIN_M).any(axis=0)
