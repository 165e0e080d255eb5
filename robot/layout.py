"""Where everything stands at the start of an epoch, drawn from the scenario's regions."""

import msgspec
import numpy as np

from config.scenario import Scenario
from robot.messages import Vec3

__all__ = ["Layout", "Standing", "draw_layout"]

Planar = tuple[float, float]


class Standing(msgspec.Struct, frozen=True, kw_only=True):
    """A loose cylinder's start: planar position (m, base frame) and turn about the vertical."""

    position_m: Planar
    yaw_rad: float


class Layout(msgspec.Struct, frozen=True, kw_only=True):
    """One drawn table, base frame."""

    fixtures_m: dict[str, Planar]
    """Planar positions of buttons and boxes by name."""
    cylinders: dict[str, Standing]
    start_m: Vec3
    """Tool centre point at the start."""


def draw_layout(scenario: Scenario, rng: np.random.Generator) -> Layout:
    """Draw one layout; every entry of the scenario draws in its order, so that the same seed is the same table."""
    fixtures = {e.name: _around(e.position_m, e.spread_m, rng) for e in (*scenario.buttons, *scenario.boxes)}
    cylinders = {}
    for cylinder in scenario.cylinders:
        x, y = _around(cylinder.position_m, cylinder.spread_m, rng)
        if cylinder.inside is not None:
            box_x, box_y = fixtures[cylinder.inside]
            x, y = x + box_x, y + box_y
        cylinders[cylinder.name] = Standing(position_m=(x, y), yaw_rad=float(rng.uniform(-np.pi, np.pi)))
    start = rng.uniform(-1.0, 1.0, 3) * scenario.start.spread_m + scenario.start.position_m
    return Layout(fixtures_m=fixtures, cylinders=cylinders, start_m=(float(start[0]), float(start[1]), float(start[2])))


def _around(centre: Planar, spread: Planar, rng: np.random.Generator) -> Planar:
    x, y = rng.uniform(-1.0, 1.0, 2) * spread + centre
    return float(x), float(y)
