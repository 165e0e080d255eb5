"""Boredom: within a trial, places already asked for lose utility, so no ripple of a model holds the arm for good."""

import numpy as np

__all__ = ["Boredom"]

Array = np.ndarray

FAR = np.float32(-30.0)
"""What lies further off does not count; smaller exponentials would be denormal numbers, which are slow."""


class Boredom:
    """The places asked for in this trial. Forgotten at its end; draws nothing."""

    def __init__(self, n_inputs: int, *, height: float, sigma: float) -> None:
        self._height, self._sharpness = height, 0.5 / sigma**2
        self._places = np.zeros((64, n_inputs), dtype=np.float32)
        self._squares = np.zeros(64, dtype=np.float32)
        self._dwelt = np.zeros(64, dtype=np.float32)
        self._n = 0

    def begin(self) -> None:
        """Forget everything."""
        self._n = 0

    def add(self, place: Array, *, n_still: int) -> None:
        """Remember a place, the more strongly the longer nothing has moved.  (n_inputs,)"""
        if self._n == len(self._places):
            self._places = np.concatenate([self._places, np.zeros_like(self._places)])
            self._squares = np.concatenate([self._squares, np.zeros_like(self._squares)])
            self._dwelt = np.concatenate([self._dwelt, np.zeros_like(self._dwelt)])
        self._places[self._n] = place
        self._squares[self._n] = place @ place
        self._dwelt[self._n] = self._height * (1.0 + n_still)
        self._n += 1

    def of(self, x: Array) -> Array:
        """Return what is taken off the utility of each place.  (k, n_inputs) -> (k,)

        height * sum over what was asked for of (1 + n_still) * exp(-|x - place|^2 / (2 sigma^2)).
        """
        if self._n == 0 or self._height == 0.0:
            return np.zeros(len(x), dtype=np.float32)
        apart = x @ self._places[: self._n].T
        apart *= -2.0
        apart += np.einsum("ij,ij->i", x, x)[:, None]
        apart += self._squares[: self._n]
        apart *= np.float32(-self._sharpness)
        np.maximum(apart, FAR, out=apart)
        return np.exp(apart, out=apart) @ self._dwelt[: self._n]
