"""A forward model learnt from P(t) and intents alone.

A distance carries no bearing; how distances change while the arm moves does. What is learnt:

* a guess of every entry's bearing from all distances at once: what P looks like from where on a usual table;
* how the tool follows the intents of the last few time steps, by height and by whether it sinks.

What is worked out anew over each short history: how the tool really moved, from how distances changed (it may have been
held up) and from what it was asked; and where things are, by trilateration drawn towards the guess.

Given is only that distances are Euclidean, and which entry is the height.
"""

from typing import Any

import numpy as np
import torch
from torch.nn.functional import smooth_l1_loss

from config.learning import ForwardModel as ForwardModelConfig
from learning.forward_model import TABLE, shaped
from learning.networks import Network, descend_together, normalised
from learning.replay import Samples
from learning.trilateration import MOST_SEEN, bearings, comes_along, share_moved
from robot.messages import Heading, Percept, StationSpec, StepResult

__all__ = ["LearnedModel"]

Array = np.ndarray

TAPS = 5
"""Time steps over which the tool follows an intent."""
FIRST_TAP = 1.0 / TAPS
SCALES_M = (0.1, 0.03)
LENGTH_M = 0.3
STEP_M = 0.02
LEAST_M, SHARE = 0.01, 0.1
"""Errors of the guess are counted in units of LEAST_M + SHARE * d."""
HELD = 0.5
"""A step that made less than this share of what was expected was held up: no lesson about following."""
TINY = 1e-8


class LearnedModel:
    """Predicts P after a move from P and intents alone."""

    def __init__(self, config: ForwardModelConfig, spec: StationSpec, rng: np.random.Generator) -> None:
        n, rate, window = spec.n_distances, config.learning_rate, config.history
        self._config, self._spec, self._rng = config, spec, rng
        self._height = spec.distance_names.index(TABLE) if TABLE in spec.distance_names else None
        self._is_thing = np.arange(n) != (-1 if self._height is None else self._height)
        self._follow = Network((2, 16, 2 * TAPS), learning_rate=rate, rng=rng, output_scale=0.01)
        sizes = ((1 + len(SCALES_M)) * n, *config.hidden, 3 * n)
        self._guess = Network(sizes, learning_rate=rate, rng=rng, output_scale=0.1)
        past = {"d": (window + 1, n), "x": (window, 3), "rests": (n,)}
        last_step = {"moves": (TAPS, 3), "size": (1,), "rise": (1,), "counts": (1,), "height": ()}
        self._samples = Samples(config.buffer_steps, past | last_step)
        self._n_trials = 0
        self._percept: Percept | None = None
        self._forget()

    # ---------------------------------------------------------------------------------------------------- the past

    def _forget(self) -> None:
        self._distances: list[Array] = []
        self._moves: list[Array] = [np.zeros(3)] * TAPS
        """What intents asked for, before the first of them nothing."""
        self._places: list[Array] = []
        """Where the tool was, as far as can be told."""

    def begin(self, percept: Percept) -> None:
        """Start from a percept; the past is kept if this is the percept that the last step ended with."""
        if percept is not self._percept:
            self._forget()
            self._distances.append(np.array(percept.distances_m))
            self._places.append(np.array([0.0, 0.0, self._height_m()]))
            self._locate()
        self._percept = percept

    def _height_m(self) -> float:
        if self._height is not None:
            return float(self._distances[-1][self._height])
        return float(self._places[-1][2]) if self._places else sum(self._spec.heights_m) / 2

    def _move(self) -> None:
        """Tell how the tool moved in the last time step: as expected, if distances changed by as much."""
        before, now = self._distances[-2], self._distances[-1]
        moves = np.array(self._moves[-TAPS:])
        step = np.einsum("ij,ij->j", self._taps(float(self._places[-1][2]), moves), moves)
        if self._height is not None:
            step[2] = now[self._height] - before[self._height]
        rests = self._is_thing & ~self._along
        self._moved = share_moved(step, before[rests], now[rests])
        step[:2] *= self._moved
        self._places.append(self._places[-1] + step)

    def _locate(self) -> None:
        """Tell where things are, and what comes along with the hand."""
        now, window = self._distances[-1], self._config.history
        guess = self._guess.rate(_seen(now[None])).reshape(-1, 3).astype(float) * LENGTH_M
        x = np.array(self._places[-1 - window : -1]).reshape(-1, 3) - self._places[-1]
        then = np.array(self._distances[-1 - window : -1]).reshape(-1, len(now))
        self._o = bearings(x, then, now, guess)
        self._along = comes_along(x, then, now) & self._is_thing
        self._ready: tuple[Array, Array] | None = None

    def _taps(self, height: float, moves: Array) -> Array:
        """Return what share of each move shows in the next time step, the oldest move first.  (TAPS, 3) -> (TAPS, 3)"""
        x = np.column_stack([np.full(len(moves), height / LENGTH_M), moves[:, 2] < 0.0]).astype(np.float32)
        out = self._follow.rate(x).reshape(-1, 2, TAPS) + FIRST_TAP
        return out[np.arange(TAPS), :, np.arange(TAPS)[::-1]][:, [0, 0, 1]]

    # --------------------------------------------------------------------------------------------------- prediction

    def predict(self, asked: Array, *, is_far: bool = False) -> Array:
        """Return the distances once the arm has come to rest on each move, (k, 3) -> (k, n)."""
        if self._ready is None:
            self._ready = self._prepare()
        o, shares = self._ready
        height = self._height_m()
        if is_far:
            q = asked - (0.0, 0.0, height)
        else:
            q = shaped(asked, height, self._spec.max_step_m)
            q *= shares[(q[:, 2] < 0.0).astype(int)]
        squares = np.einsum("ij,ij->i", q, q)[:, None] - 2.0 * (q @ o.T) + np.einsum("ij,ij->i", o, o)
        distances = np.sqrt(np.maximum(squares, TINY))
        distances[:, self._along] = self._distances[-1][self._along]
        if self._height is not None:
            distances[:, self._height] = height + q[:, 2]
        return distances

    def _prepare(self) -> tuple[Array, Array]:
        """Return where things are from where the arm will rest, and how much of a rising and a sinking move is made."""
        height = self._height_m()
        x = np.array([[height / LENGTH_M, sinks] for sinks in (0.0, 1.0)], dtype=np.float32)
        taps = self._follow.rate(x).reshape(2, 2, TAPS) + FIRST_TAP
        # Of the move asked for k steps ago, the taps from the k-th on are still to come.
        recent = np.array(self._moves[-(TAPS - 1) :])[::-1]
        to_come = taps[:, :, ::-1].cumsum(axis=2)[:, :, ::-1][:, :, 1:]
        sinks = (recent[:, 2] < 0.0).astype(int)
        ahead = (to_come[sinks, :, np.arange(TAPS - 1)][:, [0, 0, 1]] * recent).sum(axis=0)
        return self._o - ahead, taps.sum(axis=2)[:, [0, 0, 1]]

    # ----------------------------------------------------------------------------------------------------- learning

    def observe(self, intent: Heading, result: StepResult, *, is_learning: bool) -> None:
        """Take in what an intent came to: the intent and the distances, nothing else."""
        x, y = np.cos(intent.heading_rad), np.sin(intent.heading_rad)
        asked = np.array([[intent.distance_m * x, intent.distance_m * y, intent.height_m]])
        self._moves.append(shaped(asked, self._height_m(), self._spec.max_step_m)[0])
        self._distances.append(np.array(result.percept.distances_m))
        self._move()
        self._locate()
        self._percept = result.percept
        if is_learning:
            self._remember()

    def _remember(self) -> None:
        """Keep the past few steps; before the beginning the arm stood still."""
        window = self._config.history
        d, places = np.array(self._distances[-window - 1 :]), np.array(self._places[-window - 1 :])
        missing = window + 1 - len(d)
        x = places[:-1] - places[-1]
        self._samples.add(
            d=np.concatenate([np.repeat(d[:1], missing, axis=0), d]),
            x=np.concatenate([np.repeat(x[:1], missing, axis=0), x]),
            rests=(self._is_thing & ~self._along).astype(float),
            moves=np.array(self._moves[-TAPS:]),
            size=np.array([np.abs(d[-1] - d[-2])[self._is_thing & ~self._along].max(initial=0.0)]),
            rise=np.array([places[-1][2] - places[-2][2]]),
            counts=np.array([float(self._moved > HELD)]),
            height=self._distances[-2][self._height] if self._height is not None else np.array(self._places[-2][2]),
        )

    def train(self) -> None:
        """Fit the networks a little; less and less as trials go by."""
        self._n_trials += 1
        if self._samples.n < self._config.batch:
            return
        n_updates = max(1, round(self._config.updates_per_trial / (1.0 + self._n_trials / self._config.rate_half)))
        for _ in range(n_updates):
            self._update()

    def _update(self) -> None:
        batch = {k: torch.from_numpy(v) for k, v in self._samples.draw(self._config.batch, self._rng).items()}
        descend_together(self._guess_loss(batch) + self._follow_loss(batch), self._guess, self._follow)

    def _guess_loss(self, batch: dict[str, torch.Tensor]) -> torch.Tensor:
        """A bearing is right when it explains the distances there were from where the tool was: |o - x| = d_then."""
        now, then, x = batch["d"][:, -1], batch["d"][:, :-1], batch["x"]
        o = self._guess.model(torch.from_numpy(_seen(now.numpy()))).reshape(*now.shape, 3) * LENGTH_M
        seen = (o[:, None] - x[:, :, None]).norm(dim=-1)
        unit = LEAST_M + SHARE * then
        here = smooth_l1_loss(o.norm(dim=-1) / unit[:, -1], now / unit[:, -1], reduction="none")
        there = smooth_l1_loss(seen / unit, then / unit, reduction="none").mean(dim=1)
        return ((here + there) * batch["rests"]).mean()

    def _follow_loss(self, batch: dict[str, torch.Tensor]) -> torch.Tensor:
        """The tool rises as the height tells, and moves as far as the greatest change of a distance shows."""
        moves = batch["moves"]
        sinks = (moves[..., 2] < 0.0).float()
        x = torch.stack([(batch["height"] / LENGTH_M)[:, None].expand_as(sinks), sinks], dim=-1)
        out = self._follow.model(x).reshape(len(moves), TAPS, 2, TAPS) + FIRST_TAP
        taps = torch.stack([out[:, i, :, TAPS - 1 - i] for i in range(TAPS)], dim=1)[..., [0, 0, 1]]
        step = (taps * moves).sum(dim=1)
        size = (step**2).sum(dim=1, keepdim=True).add(TINY).sqrt() * MOST_SEEN
        told = torch.cat([batch["size"], batch["rise"]], dim=1) / STEP_M
        loss = smooth_l1_loss(torch.cat([size, step[:, 2:]], dim=1) / STEP_M, told, reduction="none")
        return (loss * batch["counts"]).mean()

    # -------------------------------------------------------------------------------------------------------- state

    def state_dict(self) -> dict[str, Any]:
        """Return networks, samples and the generator's state."""
        return {
            "follow": self._follow.state_dict(),
            "guess": self._guess.state_dict(),
            "samples": self._samples.state_dict(),
            "n_trials": self._n_trials,
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._follow.load_state_dict(state["follow"])
        self._guess.load_state_dict(state["guess"])
        self._samples.load_state_dict(state["samples"])
        self._n_trials = int(state["n_trials"])
        self._rng.bit_generator.state = state["rng"]


def _seen(distances_m: Array) -> Array:
    """Return distances as the guess sees them.  (k, n) -> (k, n * 3)"""
    return normalised(distances_m, np.zeros(0, dtype=np.float32), SCALES_M)
