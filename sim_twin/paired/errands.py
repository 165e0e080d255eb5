"""Seeded errands over a drawn table, driven once by a pilot so that their intents can be sent again."""

import math
from collections.abc import Iterator
from enum import StrEnum
from itertools import islice

import msgspec
import numpy as np

from robot.messages import Heading, Intent, Percept, StationSpec, StationState, StepResult
from robot.station import Station
from sim_twin.pilot import Pilot

__all__ = ["Errand", "Kind", "drive_errand"]

INSIDE_M = 0.02
DESCENT_M = 0.06
N_PLACES, NEAR_M, FAR_M = 3, 0.1, 0.25
N_DRAWN = 200
REST_STEPS = 4
END_STEPS = 10
"""Time steps at an errand's end in which the arm comes to rest on either side: what is cut off is no distance."""
RISE_STEPS = 12
Planar = tuple[float, float]


class Kind(StrEnum):
    """What an errand consists of."""

    MOVES = "moves"
    """A few places at travel height, one after the other without a rest."""
    DESCENT = "descent"
    """Down over free table, and up again."""
    PRESS = "press"
    """Down on a button until it holds the tool up, and up again."""


class Errand(msgspec.Struct, frozen=True, kw_only=True):
    """Intents, one a time step, and the reset before them."""

    kind: Kind
    seed: int
    epoch: int
    intents: tuple[Heading, ...]


class _Noting:
    """A station that notes what it is asked (robot.station.Station)."""

    def __init__(self, station: Station) -> None:
        self._station = station
        self.intents: list[Heading] = []

    @property
    def spec(self) -> StationSpec:
        return self._station.spec

    @property
    def state(self) -> StationState:
        return self._station.state

    def reset(self, *, seed: int, epoch: int) -> Percept:
        return self._station.reset(seed=seed, epoch=epoch)

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        assert isinstance(intent, Heading), "a pilot asks for nothing else"
        self.intents.append(intent)
        return self._station.step(intent, duration_s=duration_s)

    def close(self) -> None:
        self._station.close()


def drive_errand(station: Station, *, kind: Kind, seed: int, epoch: int) -> Errand:
    """Drive a station over a freshly drawn table and return what was asked of it.

    Args:
        station: Engaged.
        kind: What to do.
        seed: Of the table and of the errand.
        epoch: Whose rules are in force.
    """
    noting = _Noting(station)
    pilot = Pilot(noting)
    percept = pilot.reset(seed=seed, epoch=epoch)
    rng = np.random.default_rng([seed, epoch])
    _DRIVES[kind](pilot, percept, station.spec, rng)
    pilot.rest(END_STEPS)
    return Errand(kind=kind, seed=seed, epoch=epoch, intents=tuple(noting.intents))


def _move(pilot: Pilot, percept: Percept, spec: StationSpec, rng: np.random.Generator) -> None:
    here: Planar = percept.tcp_position_m[:2]
    for _ in range(N_PLACES):
        here = next(p for p in _places(spec, rng) if NEAR_M < math.dist(p, here) < FAR_M)
        pilot.go(*here)


def _descend(pilot: Pilot, percept: Percept, spec: StationSpec, rng: np.random.Generator) -> None:
    drawn = list(islice(_places(spec, rng), N_DRAWN))
    pilot.go(*max(drawn, key=lambda p: min(math.dist(p, o.position_m[:2]) for o in percept.objects)))
    for _ in range(math.ceil(DESCENT_M / spec.max_step_m)):
        pilot.step(height_m=pilot.travel_m - DESCENT_M)
    _rise(pilot)


def _press(pilot: Pilot, percept: Percept, spec: StationSpec, rng: np.random.Generator) -> None:
    name = percept.objects[int(rng.integers(spec.n_buttons))].name
    x, y, _ = pilot.where(name)
    pilot.go(x, y)
    pilot.rest(REST_STEPS)
    pilot.down(lambda result: result.percept.is_in_contact)
    _rise(pilot)


_DRIVES = {Kind.MOVES: _move, Kind.DESCENT: _descend, Kind.PRESS: _press}


def _rise(pilot: Pilot) -> None:
    for _ in range(RISE_STEPS):
        pilot.step()


def _places(spec: StationSpec, rng: np.random.Generator) -> Iterator[Planar]:
    """Draw places over the table."""
    low, high = spec.workspace_m
    while True:
        x, y = rng.uniform([low[0] + INSIDE_M, low[1] + INSIDE_M], [high[0] - INSIDE_M, high[1] - INSIDE_M])
        yield float(x), float(y)
