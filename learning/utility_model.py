"""One expert: the utility model of one goal, "the probability of reaching it modulated by the achieved utility".

A success leaves a trace along which utility falls linearly from 1 at its end; a failure leaves its tail at 0. A small
network is fitted to both, with smaller steps the more successes there were, and with larger ones while it fails. Two
things make few traces enough:

* relevance: a distance that is nearly the same at every success is what the goal is about; inputs are weighted by how
  steady their distance was, so that the rest cannot be mistaken for a cause;
* lamps are drawn at random in half of each batch, because a skill should not depend on them unless it must.
"""

from typing import Any

import numpy as np
import torch

from config.learning import Expert as ExpertConfig
from learning.networks import Network
from learning.replay import Replay

__all__ = ["UtilityModel", "relevance", "trace_utilities"]

Array = np.ndarray

N_ENDS = 50
"""Successes from which relevance is told."""
FEW_ENDS = 3
PRIOR_STD_M = 0.02
"""What the spread of a distance at success is taken to be before it was seen, worth two successes."""
FLOOR_STD_M = 0.006
WINDOW = 20
"""Trials of the running success."""
LOSS_BEND = 0.1
EACH = 0
"""As torch numbers its reductions: none."""
RETRAINED = 10
"""Trials' worth of training with new weights, once a model is past its first successes."""


def trace_utilities(n_steps: int, horizon: int) -> Array:
    """Return the utility of each step of a trace that ended in success: 1 at the end, falling by 1 / horizon a step."""
    return np.maximum(0.0, 1.0 - np.arange(n_steps - 1, -1, -1) / horizon)


def relevance(ends_m: Array, power: float) -> Array:
    """Return how much each distance matters, 1 for the steadiest at success.  (k, n) metres -> (n,)

    The standard deviation over successes, drawn towards a prior while there are few, against the least of them:
    ((least + floor) / (std + floor)) ** power.
    """
    n = len(ends_m)
    std = np.sqrt((ends_m.std(axis=0) ** 2 * n + PRIOR_STD_M**2 * 2) / (n + 2))
    return ((std.min() + FLOOR_STD_M) / (std + FLOOR_STD_M)) ** power


class UtilityModel:
    """Rates normalised P's by expected utility and learns from traces of success and failure."""

    def __init__(self, config: ExpertConfig, *, n_distances: int, n_states: int, rng: np.random.Generator) -> None:
        self._config, self._rng = config, rng
        self._n_distances, self._n_states = n_distances, n_states
        n_inputs = n_distances * (1 + len(config.scales_m)) + n_states
        self._network = Network((n_inputs, *config.hidden, 1), learning_rate=config.learning_rate, rng=rng)
        self._successes = Replay(config.buffer_steps, n_inputs)
        self._failures = Replay(config.buffer_steps, n_inputs)
        self._ends_m: list[list[float]] = []
        self.weights = np.ones(n_inputs, dtype=np.float32)
        """Relevance of each input."""
        self._recent: list[bool] = []
        self._clean: list[bool] = []
        """Trials that succeeded by the model alone, the newest ones."""
        self._usual_start = 0.5
        """Utility at the starts of trials that succeeded."""
        self.n_successes = 0

    def rate(self, x: Array) -> Array:
        """Return the expected utility of each normalised P.  (k, n_inputs) float32 -> (k,)"""
        return self.rate_weighted(x * self.weights)

    def rate_weighted(self, x: Array) -> Array:
        """Return the same for inputs that were weighted by relevance already."""
        return self._network.rate(x)[:, 0]

    def chance(self, x: Array) -> float:
        """Return the expected probability of success from a normalised P, in [0, 1].  (n_inputs,) -> ()

        The running success, scaled by how the utility here compares with the usual one where successes began.
        """
        if self.n_successes == 0:
            return self.skill
        shape = float(self.rate(x[None])[0]) / max(self._usual_start, 0.05)
        return min(1.0, max(0.0, self.skill * min(shape, 1.0 / max(self.skill, 1e-6))))

    @property
    def is_settled(self) -> bool:
        """Whether nearly all the last trials succeeded by the model alone: it is left as it is."""
        return len(self._clean) >= WINDOW and self._n_missed <= self._config.settled_misses

    @property
    def _assurance(self) -> float:
        """Successes, of less weight the more of the newest trials did not succeed by the model alone.

        They make the steps of Adam small. One that misses from places it seldom began at has yet to learn them, however
        much it has seen; so has one whose inputs were just weighed anew.
        """
        return self.n_successes * (sum(self._clean) / max(1, len(self._clean))) ** 2

    @property
    def _n_missed(self) -> int:
        """Trials, of the newest since the weights were told, that did not succeed by the model alone."""
        return len(self._clean) - sum(self._clean)

    @property
    def skill(self) -> float:
        """Measured chance of success where nothing blocks, pulled down a little while there are few trials."""
        return (sum(self._recent) + 0.2) / (len(self._recent) + 1.0)

    def succeed(self, trace: Array, end_m: Array, *, is_own: bool) -> None:
        """Take in a trace that ended in success: normalised P's (k, n_inputs) and the distances at its end (n,)."""
        self.n_successes += 1
        rows = trace[-self._config.trace :]
        if is_own:
            start = float(self.rate(trace[:1])[0])
            self._usual_start += 0.1 * (start - self._usual_start)
        self._successes.add(rows, trace_utilities(len(rows), self._config.horizon))
        self._ends_m = [*self._ends_m[-(N_ENDS - 1) :], end_m.tolist()]
        self._weigh()

    def _weigh(self) -> None:
        """Tell relevance anew while successes are few, later at every twentieth success where the model fails.

        New weights are a new meaning of every input: a model that works keeps those it was trained with, however seldom
        it was tried; one that is given new ones is trained with them at once.
        """
        n = self.n_successes
        is_early = n <= self._config.relevance_until
        if n < FEW_ENDS or not (is_early or (n % WINDOW == 0 and self._n_missed > self._config.settled_misses)):
            return
        self._clean = []
        weights = relevance(np.array(self._ends_m), self._config.relevance_power)
        self.weights[: -self._n_states or None] = np.tile(weights, 1 + len(self._config.scales_m))
        if not is_early:
            self._fit(RETRAINED * self._config.updates_per_trial)

    def fail(self, trace: Array) -> None:
        """Take in the end of a trace that came to nothing.  (k, n_inputs)"""
        rows = trace[-self._config.failure_tail :]
        self._failures.add(rows, np.zeros(len(rows)))

    def count(self, *, is_success: bool, is_clean: bool | None = None) -> None:
        """Count a trial that nothing blocked; a clean success is the model's alone."""
        self._clean = [*self._clean[-(WINDOW - 1) :], is_success if is_clean is None else is_clean]
        self._recent = [*self._recent[-(WINDOW - 1) :], is_success]

    def train(self) -> None:
        """Fit the network a little; a settled one is left as it is."""
        if self._successes.n and not self.is_settled:
            self._fit(self._config.updates_per_trial)

    def study(self, n_trials: int) -> None:
        """Fit the network as much as so many trials would, whatever came of those there were."""
        if self._successes.n:
            self._fit(n_trials * self._config.updates_per_trial)

    def _fit(self, n_updates: int) -> None:
        self._network.learning_rate = self._config.learning_rate / (1.0 + self._assurance / self._config.rate_half)
        for _ in range(n_updates):
            self._update()

    def _update(self) -> None:
        """One step of Adam on a batch of successes and failures.

        The loss is a smooth L1, on successes weighted as an expectile: the better of two traces through the same place
        counts for more, so that detours fade.
        """
        x, y, n_failed = self._batch()
        wanted, tau = torch.from_numpy(y), self._config.expectile

        def slope(u: torch.Tensor) -> torch.Tensor:
            weight = torch.where(wanted > u, 2.0 * tau, 2.0 * (1.0 - tau))
            if n_failed:
                weight[-n_failed:] = 1.0
            return torch.ops.aten.smooth_l1_loss_backward(weight / len(u), u, wanted, EACH, LOSS_BEND)

        self._network.descend_by(x, slope)

    def _batch(self) -> tuple[Array, Array, int]:
        """Return inputs, utilities and how many of the last rows are failures."""
        config, n = self._config, self._config.batch
        share = config.failure_weight * self._failures.n / (self._failures.n + self._successes.n)
        n_failed = round(n * min(config.failure_share, share))
        good = self._rng.integers(0, self._successes.n, n - n_failed)
        bad = self._rng.integers(0, max(1, self._failures.n), n_failed)
        x = np.concatenate([self._successes.x[good], self._failures.x[bad]]) * self.weights
        y = np.concatenate([self._successes.y[good], self._failures.y[bad]])
        m, drawn = self._n_states, round(config.lamps_drawn * n)
        if m and drawn:
            x[:drawn, -m:] = self._rng.integers(0, 2, (drawn, m))
            x[n - n_failed :, -m:] = self._rng.integers(0, 2, (n_failed, m))
        return x, y, n_failed

    def state_dict(self) -> dict[str, Any]:
        """Return everything learnt and the generator's state."""
        return {
            "network": self._network.state_dict(),
            "successes": self._successes.state_dict(),
            "failures": self._failures.state_dict(),
            "ends_m": np.array(self._ends_m, dtype=float).reshape(-1, self._n_distances),
            "weights": self.weights.copy(),
            "recent": list(self._recent),
            "clean": list(self._clean),
            "usual_start": self._usual_start,
            "n_successes": self.n_successes,
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._network.load_state_dict(state["network"])
        self._successes.load_state_dict(state["successes"])
        self._failures.load_state_dict(state["failures"])
        self._ends_m = np.array(state["ends_m"]).tolist()
        self.weights[:] = state["weights"]
        self._recent = list(state["recent"])
        self._clean = list(state["clean"])
        self._usual_start = float(state["usual_start"])
        self.n_successes = int(state["n_successes"])
        self._rng.bit_generator.state = state["rng"]
