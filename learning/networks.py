"""Small networks: torch trains them, numpy rates with the very same memory. Weights come from a numpy generator."""

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import nn

__all__ = ["Array", "Network", "descend_together", "normalised", "width"]

Array = np.ndarray

LENGTH_M = 0.3
"""What a distance is divided by for the linear entry of its normalisation."""


def normalised(distances_m: Array, states: Array, scales_m: tuple[float, ...]) -> Array:
    """Return P(t) as networks and novelty see it: d / 0.3 m, exp(-d / scale) for each scale, then the states.

    Elementwise, so an entry keeps its meaning wherever it stands: the exponentials tell near from nearer.

    Args:
        distances_m: d_1..d_n, a row per place, (k, n).
        states: s_1..s_m, the same for every place, (m,).
        scales_m: Ranges at which the exponentials fall to 1/e.

    Returns:
        float32, (k, n * (1 + len(scales)) + m).
    """
    n_places, n = distances_m.shape
    out = np.empty((n_places, n * (1 + len(scales_m)) + states.shape[0]), dtype=np.float32)
    out[:, :n] = distances_m
    for i, scale in enumerate(scales_m, start=1):
        np.multiply(out[:, :n], np.float32(-1.0 / scale), out=out[:, i * n : (i + 1) * n])
    np.exp(out[:, n : n * (1 + len(scales_m))], out=out[:, n : n * (1 + len(scales_m))])
    out[:, :n] *= np.float32(1.0 / LENGTH_M)
    out[:, n * (1 + len(scales_m)) :] = states
    return out


def width(n_distances: int, n_states: int, scales_m: tuple[float, ...]) -> int:
    """Return how many entries a normalised P(t) has."""
    return n_distances * (1 + len(scales_m)) + n_states


class Network:
    """A rectified multilayer perceptron with Adam.

    numpy's view and torch's parameters share their memory, so what is rated is bit for bit what was trained.
    """

    def __init__(
        self, sizes: tuple[int, ...], *, learning_rate: float, rng: np.random.Generator, output_scale: float = 1.0
    ) -> None:
        layers: list[nn.Module] = []
        for i, (n_in, n_out) in enumerate(pairwise(sizes)):
            layers += ([nn.ReLU()] if i else []) + [nn.Linear(n_in, n_out)]
        self.model = nn.Sequential(*layers)
        self._parameters = list(self.model.parameters())
        self._views = [p.detach().numpy() for p in self._parameters]
        for view in self._views:
            bound = np.sqrt(6.0 / view.shape[1]) if view.ndim == 2 else 0.0
            view[...] = rng.uniform(-bound, bound, view.shape)
        self._views[-2] *= output_scale
        self.optimiser = torch.optim.Adam(self._parameters, lr=learning_rate, betas=(0.9, 0.99), eps=1e-5, fused=True)

    @property
    def learning_rate(self) -> float:
        """Adam's step."""
        return self.optimiser.param_groups[0]["lr"]

    @learning_rate.setter
    def learning_rate(self, rate: float) -> None:
        self.optimiser.param_groups[0]["lr"] = rate

    def rate(self, x: Array) -> Array:
        """Return the network's output for each row.  (k, n_in) float32 -> (k, n_out)"""
        weights = self._views
        for i in range(0, len(weights), 2):
            if i:
                np.maximum(x, 0.0, out=x)
            x = x @ weights[i].T
            x += weights[i + 1]
        return x

    def descend(self, loss: torch.Tensor) -> float:
        """Take one step of Adam down a loss and return the loss."""
        return descend_together(loss, self)

    def state_dict(self) -> dict[str, Any]:
        """Return weights and Adam's moments, in the order of the layers."""
        moments = [self.optimiser.state.get(p, {}) for p in self._parameters]
        return {
            "weights": [view.copy() for view in self._views],
            "moments": [{k: v.numpy().copy() for k, v in m.items()} for m in moments],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        for view, weights in zip(self._views, state["weights"], strict=True):
            view[...] = weights
        self.optimiser.state.clear()
        for parameter, moments in zip(self._parameters, state["moments"], strict=True):
            if moments:
                self.optimiser.state[parameter] = {k: torch.from_numpy(np.array(v)) for k, v in moments.items()}


def descend_together(loss: torch.Tensor, *networks: Network) -> float:
    """Take one step of Adam down a loss in several networks at once and return the loss."""
    for network in networks:
        network.optimiser.zero_grad()
    loss.backward()
    for network in networks:
        network.optimiser.step()
    return float(loss.detach())
