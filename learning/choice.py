"""Softmax choice. Pure: the generator comes in."""

from collections.abc import Sequence

import numpy as np

__all__ = ["draw", "softmax"]


def softmax(values: np.ndarray, temperature: float, available: Sequence[bool] | None = None) -> np.ndarray:
    """Return choice probabilities exp(value / temperature), normalised over what is available.  (n,) -> (n,)

    The largest available value is subtracted first, so that no temperature, however small, overflows.

    Raises:
        ValueError: nothing is available, or the temperature is not positive.
    """
    if not temperature > 0.0:
        message = f"expected a temperature above 0, got {temperature}"
        raise ValueError(message)
    mask = np.ones(len(values), dtype=bool) if available is None else np.asarray(available, dtype=bool)
    if not mask.any():
        raise ValueError("expected at least one available choice, got none")
    shifted = np.where(mask, values - values[mask].max(), -np.inf)
    weights = np.exp(shifted / temperature)
    return weights / weights.sum()


def draw(probabilities: np.ndarray, rng: np.random.Generator) -> int:
    """Return an index drawn with the given probabilities, never one of probability zero.  (n,) -> ()"""
    cumulated = np.cumsum(probabilities)
    index = int(np.searchsorted(cumulated, rng.random() * cumulated[-1], side="right"))
    return min(index, int(np.flatnonzero(probabilities)[-1]))
