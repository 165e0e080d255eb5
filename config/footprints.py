"""Worst-case clearances on the table: how near two things can come when each is drawn from its region. Pure."""

import math

import msgspec

from config.scenario import Box, Button, Cylinder

__all__ = [
    "Footprint",
    "clearance_m",
    "footprint_of_box",
    "footprint_of_button",
    "footprint_of_cylinder",
    "leaf_length_m",
]

BUTTON_RIM_M = 0.006
"""The ring around a button's cap."""


class Footprint(msgspec.Struct, frozen=True, kw_only=True):
    """What a thing covers of the table: a rectangle widened by a radius, drawn from a region around its centre."""

    centre_m: tuple[float, float]
    spread_m: tuple[float, float]
    half_m: tuple[float, float] = (0.0, 0.0)
    radius_m: float = 0.0

    def region_m(self) -> tuple[float, float, float, float]:
        """Return the least x, least y, greatest x and greatest y that any of it can cover."""
        rx, ry = (self.spread_m[i] + self.half_m[i] + self.radius_m for i in (0, 1))
        x, y = self.centre_m
        return x - rx, y - ry, x + rx, y + ry


def clearance_m(a: Footprint, b: Footprint) -> float:
    """Return the least distance between the two over all draws; negative where they can overlap.

    The gap of two axis-aligned rectangles is the norm of the positive parts of the gaps along x and y; where both
    overlap it is the smaller penetration. Rounded shapes are rectangles widened by a radius.
    """
    gaps = [
        abs(a.centre_m[i] - b.centre_m[i]) - a.spread_m[i] - b.spread_m[i] - a.half_m[i] - b.half_m[i] for i in (0, 1)
    ]
    apart = math.hypot(*(max(0.0, gap) for gap in gaps))
    return (apart or max(gaps)) - a.radius_m - b.radius_m


def footprint_of_button(button: Button) -> Footprint:
    """Return what a button with its rim covers."""
    return Footprint(
        centre_m=button.position_m, spread_m=button.spread_m, radius_m=button.diameter_m / 2 + BUTTON_RIM_M
    )


def footprint_of_box(box: Box, *, with_leaves: bool) -> Footprint:
    """Return what a box covers, with the lean of its open leaves beyond the walls (they swing along x) or without."""
    half_x, half_y = (inner / 2 + box.wall_m for inner in box.inner_m)
    lean = 0.0
    if with_leaves and box.lid is not None:
        lean = leaf_length_m(box) * max(0.0, -math.cos(box.lid.open_angle_rad))
    return Footprint(centre_m=box.position_m, spread_m=box.spread_m, half_m=(half_x + lean, half_y))


def footprint_of_cylinder(cylinder: Cylinder) -> Footprint:
    """Return what a standing cylinder covers, relative to its box where it starts in one."""
    return Footprint(centre_m=cylinder.position_m, spread_m=cylinder.spread_m, radius_m=cylinder.diameter_m / 2)


def leaf_length_m(box: Box) -> float:
    """Return the length of a lid's leaf: from the middle of a wall to the middle of the box."""
    return (box.inner_m[0] + box.wall_m) / 2
