"""What a person would draw around on the guided sample: rough polygons well inside what they name."""

import numpy as np
from numpy.typing import NDArray

from config.scenario import Box, Scenario
from robot.messages import ObjectPose
from robot.photographs import NamedRegion
from sim_twin.studio.viewing import View

__all__ = ["named_regions"]

Array = NDArray[np.float64]
N_CORNERS = 10
INSIDE = 0.85
"""Of a round thing's radius: nobody draws along its edge."""


def named_regions(
    scenario: Scenario, objects: tuple[ObjectPose, ...], view: View, *, is_lit: bool
) -> tuple[NamedRegion, ...]:
    """Return polygons inside each cap and its base, each cylinder and box, and on free table.

    Lids are shut where the lamps are lit: what is in the boxes is named on the other picture.
    """
    place, T_bc = {o.name: np.array(o.position_m) for o in objects}, view.T_bc
    polygons: list[tuple[str, str, Array]] = []
    for button in scenario.buttons:
        radius, cap = button.diameter_m / 2, place[button.name]
        edge = cap + np.array([0.0, 0.0, button.cap_m / 2])
        polygons.append((button.name, "on" if is_lit else "off", _disc(edge, INSIDE * radius)))
        if is_lit:
            foot = cap - np.array([0.0, 0.0, button.cap_m / 2 + button.travel_m])
            polygons.append(("base", "", _front(foot, INSIDE * radius, 0.5 * foot[2], T_bc)))
    for box in scenario.boxes:
        polygons += [(box.name, "", part) for part in _box_parts(box, place[box.name], is_shut=is_lit)]
    for cylinder in () if is_lit else scenario.cylinders:
        top = place[cylinder.name] + np.array([0.0, 0.0, cylinder.height_m / 2])
        radius = INSIDE * cylinder.diameter_m / 2
        polygons.append((cylinder.name, "", _disc(top, radius)))
        polygons.append((cylinder.name, "", _front(top, radius, 0.3 * cylinder.height_m, T_bc)))
    x, y = scenario.table.centre_m
    free = [[x + u, y + v, scenario.table.height_m] for u, v in ((0.28, -0.3), (0.28, 0.3), (0.36, 0.3), (0.36, -0.3))]
    polygons.append(("table", "", np.array(free)))
    return tuple(_region(name, state, _inside(view, view.seen_at(polygon))) for name, state, polygon in polygons)


def _box_parts(box: Box, floor_m: Array, *, is_shut: bool) -> list[Array]:
    """Return strips of a box's floor beside what stands in it, or its lid's two leaves."""
    lx, ly = box.inner_m
    if is_shut and box.lid is not None:
        up = box.height_m + box.lid.thickness_m + box.lid.padding_m
        spans = [((-0.42, -0.42), (-0.1, 0.42)), ((0.1, -0.42), (0.42, 0.42))]
    else:
        up = 0.001
        spans = [((-0.3, -0.44), (0.3, -0.36)), ((-0.3, 0.36), (0.3, 0.44))]
    return [
        floor_m + np.array([[x * lx, y * ly, up] for x, y in ((a, b), (c, b), (c, d), (a, d))])
        for (a, b), (c, d) in spans
    ]


def _inside(view: View, pixels: Array) -> Array:
    """Return pixels, those beyond the picture's edge drawn back to it.  (n, 2) -> (n, 2)"""
    return np.clip(pixels, 0.0, (view.lens.width_px - 1, view.lens.height_px - 1))


def _region(name: str, state: str, pixels: Array) -> NamedRegion:
    return NamedRegion(name=name, state=state, polygon_px=tuple((float(u), float(v)) for u, v in pixels))


def _disc(centre_m: Array, radius_m: float) -> Array:
    turn = np.linspace(0.0, 2.0 * np.pi, N_CORNERS, endpoint=False)
    return centre_m + radius_m * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(N_CORNERS)])


def _front(top_m: Array, radius_m: float, height_m: float, T_bc: Array) -> Array:
    """Return the upper part of a standing cylinder's side that faces the camera."""
    towards = T_bc[:2, 3] - top_m[:2]
    bearing = float(np.arctan2(towards[1], towards[0])) + np.array([-0.8, -0.3, 0.3, 0.8])
    arc = np.column_stack([np.cos(bearing), np.sin(bearing), np.zeros(4)]) * radius_m / INSIDE
    return np.concatenate([top_m + arc - [0, 0, 0.1 * height_m], (top_m + arc - [0, 0, height_m])[::-1]])
