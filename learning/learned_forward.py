"""A forward model learnt from P(t) and intents alone.

A distance carries no bearing; how distances change while the arm moves does. What is learnt:

* a guess of every entry's bearing from all distances at once: what P looks like from where on a usual table;
* how wrong that guess is, thing by thing;
* how the tool follows the intents of the last few time steps, by height and by whether it sinks.

What is worked out anew in each trial is a map: where the tool and the things are, from the guess, from what was asked
and from all distances since the trial began (learning.range_map). Its end teaches what is learnt, in hindsight.

Given is only that distances are Euclidean, and which entry is the height.
"""

from typing import Any

import numpy as np
import torch
from torch.nn.functional import smooth_l1_loss

from config.learning import ForwardModel as ForwardModelConfig
from learning.forward_model import TABLE, shaped
from learning.networks import Network, descend_together, normalised
from learning.range_map import RangeMap
from learning.replay import Samples
from learning.trilateration import relocate
from robot.messages import Heading, Percept, StationSpec, StepResult

__all__ = ["LearnedModel"]

Array = np.ndarray

TAPS = 5
"""Time steps over which the tool follows an intent."""
FIRST_TAP = 1.0 / TAPS
SCALES_M = (0.1, 0.03)
LENGTH_M = 0.3
STEP_M = 0.01
LEAST_M, SHARE = 0.01, 0.1
"""Errors of the guess are counted in units of LEAST_M + SHARE * d."""
SLIP_M, SLIP = 0.002, 0.5
"""A step may differ from what was expected by SLIP_M + SLIP * its length."""
HELD = 0.5
"""A step that made less than this share of what was expected was held up: what is still to come of it will be too."""
HELD_UP = 0.25
"""A step that made less than this share of the mean of the moves asked for is no lesson about following."""
LEAST_STEP_M = 0.003
FIRST_DOUBT_M, LEAST_DOUBT_M = 0.3, 0.01
DOUBT_RATE = 0.05
SURE_M = 0.03
"""A bearing that is unsure by this counts half as a lesson."""
TINY = 1e-8


class LearnedModel:
    """Predicts P after a move from P and intents alone."""

    def __init__(self, config: ForwardModelConfig, spec: StationSpec, rng: np.random.Generator) -> None:
        n, rate = spec.n_distances, config.learning_rate
        self._config, self._spec, self._rng = config, spec, rng
        self._height = spec.distance_names.index(TABLE) if TABLE in spec.distance_names else None
        self._is_thing = np.arange(n) != (-1 if self._height is None else self._height)
        self._follow = Network((2, 16, 2 * TAPS), learning_rate=rate, rng=rng, output_scale=0.01)
        sizes = ((1 + len(SCALES_M)) * n, *config.hidden, 3 * n)
        self._guess = Network(sizes, learning_rate=rate, rng=rng, output_scale=0.1)
        self._doubt_m2 = np.full(n, FIRST_DOUBT_M**2)
        """How wrong the guess is, mean square of an axis, by entry."""
        self._bearings = Samples(config.buffer_steps, {"d": (n,), "o": (n, 3), "weight": (n,)})
        self._steps = Samples(config.buffer_steps, {"moves": (TAPS, 3), "step": (3,), "counts": (3,), "height": ()})
        self._n_trials = 0
        self._percept: Percept | None = None
        self._is_learning = False
        self._distances: list[Array] = []

    # ---------------------------------------------------------------------------------------------------- the past

    def begin(self, percept: Percept) -> None:
        """Start from a percept; the past is kept if this is the percept that the last step ended with."""
        if percept is self._percept:
            return
        now = np.array(percept.distances_m)
        self._percept, self._is_learning = percept, False
        self._distances = [now]
        self._asked = [np.zeros(3)] * TAPS
        """What intents asked for, before the first of them nothing."""
        self._to_come = [np.zeros(3)] * TAPS
        """The same, less what was held up."""
        guess = self._guess.rate(_seen(now[None])).reshape(-1, 3).astype(float) * LENGTH_M
        height = sum(self._spec.heights_m) / 2 if self._height is None else float(now[self._height])
        self._map = RangeMap(
            guess,
            np.minimum(np.sqrt(self._doubt_m2), now),
            height_m=height,
            is_thing=self._is_thing,
            window=self._config.history,
        )
        self._map.see(now, self._measured_height())
        self._places = [self._map.place_m.copy()]
        self._ready: tuple[Array, Array, float] | None = None

    def _measured_height(self) -> float | None:
        return None if self._height is None else float(self._distances[-1][self._height])

    def _taps(self, height: float, moves: Array) -> Array:
        """Return what share of each move shows in the next time step, the oldest move first.  (TAPS, 3) -> (TAPS, 3)"""
        x = np.column_stack([np.full(len(moves), height / LENGTH_M), moves[:, 2] < 0.0]).astype(np.float32)
        out = self._follow.rate(x).reshape(-1, 2, TAPS) + FIRST_TAP
        return out[np.arange(TAPS), :, np.arange(TAPS)[::-1]][:, [0, 0, 1]]

    def observe(self, intent: Heading, result: StepResult, *, is_learning: bool) -> None:
        """Take in what an intent came to: the intent and the distances, nothing else."""
        x, y = np.cos(intent.heading_rad), np.sin(intent.heading_rad)
        asked = np.array([[intent.distance_m * x, intent.distance_m * y, intent.height_m]])
        before = self._map.place_m.copy()
        move = shaped(asked, self._at_rest()[2], self._spec.max_step_m)[0]
        self._asked.append(move)
        self._to_come = [*self._to_come[1:], move]
        self._percept, self._is_learning = result.percept, is_learning
        self._distances.append(np.array(result.percept.distances_m))
        pending = np.array(self._to_come)
        step = np.einsum("ij,ij->j", self._taps(float(before[2]), pending), pending)
        self._map.move(step, SLIP_M + SLIP * float(np.sqrt(step @ step)))
        self._map.see(self._distances[-1], self._measured_height())
        self._places.append(self._map.place_m.copy())
        self._note_held(step, self._map.place_m - before)
        self._ready = None

    def _note_held(self, expected: Array, made: Array) -> None:
        """What did not come of moves that were held up will not come later."""
        for axes in (slice(0, 2), slice(2, 3)):
            size2 = float(expected[axes] @ expected[axes])
            if size2 < LEAST_STEP_M**2:
                continue
            share = max(0.0, float(expected[axes] @ made[axes]) / size2)
            if share < HELD:
                self._to_come = [move.copy() for move in self._to_come]
                for move in self._to_come:
                    move[axes] *= share

    # --------------------------------------------------------------------------------------------------- prediction

    def predict(self, asked: Array, *, is_far: bool = False) -> Array:
        """Return the distances once the arm has come to rest on each move, (k, 3) -> (k, n)."""
        o, shares, height = self._at_rest()
        if is_far:
            q = asked - (0.0, 0.0, height)
        else:
            q = shaped(asked, height, self._spec.max_step_m)
            q *= shares[(q[:, 2] < 0.0).astype(int)]
        squares = np.einsum("ij,ij->i", q, q)[:, None] - 2.0 * (q @ o.T) + np.einsum("ij,ij->i", o, o)
        distances = np.sqrt(np.maximum(squares, TINY))
        along = self._map.carried
        distances[:, along] = self._distances[-1][along]
        if self._height is not None:
            distances[:, self._height] = height + q[:, 2]
        return distances

    def _at_rest(self) -> tuple[Array, Array, float]:
        """Return where things are from where the arm will rest, how much of moves is made, and the height there.

        Returns:
            Displacements, metres, (n, 3); share of a rising and of a sinking move by axis, (2, 3); metres.
        """
        if self._ready is None:
            ahead, shares = self._following()
            rest = self._map.place_m + ahead
            self._ready = self._map.things_m - rest, shares, float(rest[2])
        return self._ready

    def _following(self) -> tuple[Array, Array]:
        """Return what is still to come of moves, (3,), and how much of a rising and a sinking one is made, (2, 3)."""
        height = float(self._map.place_m[2])
        x = np.array([[height / LENGTH_M, sinks] for sinks in (0.0, 1.0)], dtype=np.float32)
        taps = self._follow.rate(x).reshape(2, 2, TAPS) + FIRST_TAP
        # Of the move asked for k steps ago, the taps from the k-th on are still to come.
        recent = np.array(self._to_come[-(TAPS - 1) :])[::-1]
        to_come = taps[:, :, ::-1].cumsum(axis=2)[:, :, ::-1][:, :, 1:]
        sinks = (recent[:, 2] < 0.0).astype(int)
        ahead = (to_come[sinks, :, np.arange(TAPS - 1)][:, [0, 0, 1]] * recent).sum(axis=0)
        return ahead, taps.sum(axis=2)[:, [0, 0, 1]]

    # ----------------------------------------------------------------------------------------------------- learning

    def train(self) -> None:
        """Take in what the trial showed in hindsight and fit the networks a little; less and less as trials go by."""
        self._n_trials += 1
        if self._is_learning and len(self._distances) > 1:
            self._remember()
        if self._steps.n < self._config.batch:
            return
        n_updates = max(1, round(self._config.updates_per_trial / (1.0 + self._n_trials / self._config.rate_half)))
        for _ in range(n_updates):
            self._update()

    def _remember(self) -> None:
        """Keep each step of the trial, seen from the map as it is known at its end."""
        d, n = np.array(self._distances), len(self._distances)
        rested, doubt_m2 = self._map.rested, self._map.doubt_m2()
        weight = rested / (1.0 + doubt_m2 / SURE_M**2)
        places = relocate(np.array(self._places), d, self._map.things_m, weight, keeps_height=self._height is not None)
        o = self._map.things_m - places[:, None]
        wrong = (self._guess.rate(_seen(d[:1])).reshape(-1, 3) * LENGTH_M - o[0]) ** 2
        doubt = np.maximum(wrong.mean(axis=1) + doubt_m2, LEAST_DOUBT_M**2)
        self._doubt_m2 += np.where(rested, DOUBT_RATE * (doubt - self._doubt_m2), 0.0)
        for k in range(n):
            self._bearings.add(d=d[k], o=o[k], weight=weight)
        for k in range(1, n):
            moves = np.array(self._asked[k : k + TAPS])
            step = places[k] - places[k - 1]
            self._steps.add(moves=moves, step=step, counts=_went_on(moves.mean(axis=0), step), height=places[k - 1, 2])
        self._distances, self._places, self._asked = self._distances[-1:], self._places[-1:], self._asked[-TAPS:]

    def _update(self) -> None:
        bearings, steps = (
            {name: torch.from_numpy(array) for name, array in samples.draw(self._config.batch, self._rng).items()}
            for samples in (self._bearings, self._steps)
        )
        descend_together(self._guess_loss(bearings) + self._follow_loss(steps), self._guess, self._follow)

    def _guess_loss(self, batch: dict[str, torch.Tensor]) -> torch.Tensor:
        """A bearing is right when it is the one that the map had in the end."""
        seen = torch.from_numpy(_seen(batch["d"].numpy()))
        o = self._guess.model(seen).reshape(*batch["o"].shape) * LENGTH_M
        unit = (LEAST_M + SHARE * batch["d"])[..., None]
        loss = smooth_l1_loss(o / unit, batch["o"] / unit, reduction="none").mean(dim=-1)
        return (loss * batch["weight"]).mean()

    def _follow_loss(self, batch: dict[str, torch.Tensor]) -> torch.Tensor:
        """The tool made the step that the map saw."""
        moves = batch["moves"]
        sinks = (moves[..., 2] < 0.0).float()
        x = torch.stack([(batch["height"] / LENGTH_M)[:, None].expand_as(sinks), sinks], dim=-1)
        out = self._follow.model(x).reshape(len(moves), TAPS, 2, TAPS) + FIRST_TAP
        taps = torch.stack([out[:, i, :, TAPS - 1 - i] for i in range(TAPS)], dim=1)[..., [0, 0, 1]]
        step = (taps * moves).sum(dim=1)
        loss = smooth_l1_loss(step / STEP_M, batch["step"] / STEP_M, beta=0.1, reduction="none")
        return (loss * batch["counts"]).mean()

    # -------------------------------------------------------------------------------------------------------- state

    def state_dict(self) -> dict[str, Any]:
        """Return networks, doubts, samples and the generator's state."""
        return {
            "follow": self._follow.state_dict(),
            "guess": self._guess.state_dict(),
            "doubt_m2": self._doubt_m2.copy(),
            "bearings": self._bearings.state_dict(),
            "steps": self._steps.state_dict(),
            "n_trials": self._n_trials,
            "rng": self._rng.bit_generator.state,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._follow.load_state_dict(state["follow"])
        self._guess.load_state_dict(state["guess"])
        self._doubt_m2 = np.array(state["doubt_m2"])
        self._bearings.load_state_dict(state["bearings"])
        self._steps.load_state_dict(state["steps"])
        self._n_trials = int(state["n_trials"])
        self._rng.bit_generator.state = state["rng"]


def _went_on(expected: Array, made: Array) -> Array:
    """Return which axes of a step teach following: none that was held up, by what an untaught tool would have made."""
    counts = np.ones(3)
    for axes in (slice(0, 2), slice(2, 3)):
        size2 = float(expected[axes] @ expected[axes])
        if size2 > LEAST_STEP_M**2 and float(expected[axes] @ made[axes]) < HELD_UP * size2:
            counts[axes] = 0.0
    return counts


def _seen(distances_m: Array) -> Array:
    """Return distances as the guess sees them.  (k, n) -> (k, n * 3)"""
    return normalised(distances_m, np.zeros(0, dtype=np.float32), SCALES_M)
