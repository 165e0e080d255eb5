"""Seeded errands over a drawn table, driven once by a pilot so that their intents can be sent again."""

import math

import msgspec
import numpy as np

from robot.messages import Heading, Intent, Percept, StationSpec, StepResult
from robot.station import Station
from sim_twin.pilot import Pilot

__all__ = ["Errand", "Pace", "drive_errand"]

CLEAR_M = 0.15
"""Of everything on the table when the tool goes down beside it."""
INSIDE_M = 0.02
DESCENT_M = 0.06
N_TRIES = 200


class Pace(msgspec.Struct, frozen=True, kw_only=True):
    """How much there is to an errand."""

    n_points: int = 3
    """Places at travel height that the tool goes to."""
    has_descent: bool = True
    """It goes down over free table and up again."""
    has_press: bool = True
    """It presses a button."""


class Errand(msgspec.Struct, frozen=True, kw_only=True):
    """Intents, one a time step, and the reset before them."""

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
    def state(self):  # noqa: ANN202 - the station's own
        return self._station.state

    def reset(self, *, seed: int, epoch: int) -> Percept:
        return self._station.reset(seed=seed, epoch=epoch)

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        assert isinstance(intent, Heading), "a pilot asks for nothing else"
        self.intents.append(intent)
        return self._station.step(intent, duration_s=duration_s)

    def close(self) -> None:
        self._station.close()


def drive_errand(station: Station, *, seed: int, epoch: int, pace: Pace) -> Errand:
    """Drive a station over a freshly drawn table and return what was asked of it.

    Args:
        station: Engaged.
        seed: Of the table and of the errand.
        epoch: Whose rules are in force.
        pace: How much there is to it.
    """
    noting = _Noting(station)
    pilot = Pilot(noting)
    percept = pilot.reset(seed=seed, epoch=epoch)
    rng = np.random.default_rng([seed, epoch])
    for _ in range(pace.n_points):
        pilot.go(*_somewhere(station.spec, rng))
    if pace.has_descent:
        pilot.go(*_beside_everything(percept, station.spec, rng))
        pilot.rest(3)
        for _ in range(round(DESCENT_M / station.spec.max_step_m) + 1):
            pilot.step(height_m=pilot.travel_m - DESCENT_M)
        _rise(pilot)
    if pace.has_press:
        names = [o.name for o in percept.objects][: station.spec.n_buttons]
        at = pilot.where(names[int(rng.integers(len(names)))])
        pilot.go(at[0], at[1])
        pilot.rest(3)
        pilot.down(lambda result: result.percept.is_in_contact)
        _rise(pilot)
    pilot.rest(4)
    return Errand(seed=seed, epoch=epoch, intents=tuple(noting.intents))


def _rise(pilot: Pilot) -> None:
    for _ in range(12):
        pilot.step()


def _somewhere(spec: StationSpec, rng: np.random.Generator) -> tuple[float, float]:
    low, high = spec.workspace_m
    x, y = rng.uniform([low[0] + INSIDE_M, low[1] + INSIDE_M], [high[0] - INSIDE_M, high[1] - INSIDE_M])
    return float(x), float(y)


def _beside_everything(percept: Percept, spec: StationSpec, rng: np.random.Generator) -> tuple[float, float]:
    """Return a place that is clear of what stands on the table, or the clearest of those drawn."""

    def clearance_m(place: tuple[float, float]) -> float:
        return min(math.dist(place, o.position_m[:2]) for o in percept.objects)

    drawn = [_somewhere(spec, rng) for _ in range(N_TRIES)]
    return next((place for place in drawn if clearance_m(place) > CLEAR_M), max(drawn, key=clearance_m))
