"""Small networks: torch trains them, numpy rates with the very same memory. Weights come from a numpy generator."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.optim.adam import adam

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
        self._moments = [_no_moments(p) for p in self._parameters]
        self.learning_rate = learning_rate
        """Adam's step."""

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

    @torch.no_grad()
    def descend_by(self, x: Array, slope: Callable[[torch.Tensor], torch.Tensor]) -> None:
        """Take one step of Adam down a loss that is told by its slope: the sums of autograd, without its book-keeping.

        For so small a network building and walking through autograd's graph takes as long as the sums.

        Args:
            x: a row a case, (k, n_in) float32.
            slope: returns the derivative of the loss by each case's output, of which there is one.  (k,) -> (k,)
        """
        layers = list(zip(self._parameters[::2], self._parameters[1::2], strict=True))
        inputs = [torch.from_numpy(x)]
        for weights, bias in layers[:-1]:
            inputs.append(torch.addmm(bias, inputs[-1], weights.t()).relu_())
        last, bias = layers[-1]
        gradient = slope(torch.addmm(bias, inputs[-1], last.t())[:, 0]).unsqueeze(1)  # (k, 1)
        for i, (weights, bias) in reversed(list(enumerate(layers))):
            weights.grad, bias.grad = gradient.t().mm(inputs[i]), gradient.sum(0)
            if i:
                gradient = torch.ops.aten.threshold_backward(gradient.mm(weights), inputs[i], 0)
        self.step()

    def state_dict(self) -> dict[str, Any]:
        """Return weights and Adam's moments, in the order of the layers."""
        return {
            "weights": [view.copy() for view in self._views],
            "moments": [{k: v.numpy().copy() for k, v in m.items()} for m in self._moments],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        for view, weights in zip(self._views, state["weights"], strict=True):
            view[...] = weights
        self._moments = [
            {k: torch.from_numpy(np.array(v)) for k, v in moments.items()} or _no_moments(parameter)
            for parameter, moments in zip(self._parameters, state["moments"], strict=True)
        ]

    def forget_gradients(self) -> None:
        """Begin a descent anew."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Take one step of Adam down the gradients that came.

        By torch's function, not its class: the class imports a compiler, a second and a half of every start.
        """
        at = [i for i, p in enumerate(self._parameters) if p.grad is not None]
        gradients = [g for p in self._parameters if (g := p.grad) is not None]
        first, second, steps = ([self._moments[i][name] for i in at] for name in ("exp_avg", "exp_avg_sq", "step"))
        adam(
            [self._parameters[i] for i in at], gradients, first, second, [], steps, fused=True, amsgrad=False,
            beta1=0.9, beta2=0.99, lr=self.learning_rate, weight_decay=0.0, eps=1e-5, maximize=False,
        )  # fmt: skip


def descend_together(loss: torch.Tensor, *networks: Network) -> float:
    """Take one step of Adam down a loss in several networks at once and return the loss."""
    for network in networks:
        network.forget_gradients()
    loss.backward()
    for network in networks:
        network.step()
    return float(loss.detach())


def _no_moments(parameter: nn.Parameter) -> dict[str, torch.Tensor]:
    return {
        "step": torch.zeros((), dtype=torch.float32),
        "exp_avg": torch.zeros_like(parameter, memory_format=torch.preserve_format).detach(),
        "exp_avg_sq": torch.zeros_like(parameter, memory_format=torch.preserve_format).detach(),
    }
