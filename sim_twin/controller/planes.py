"""Safety planes as somebody sets them up: four numbers each. Pure."""

import math
from collections.abc import Iterable

from sim_twin.controller.motion import Plane

__all__ = ["PlaneNumbers", "parse_plane", "planes_of"]

PlaneNumbers = tuple[float, float, float, float]
"""A normal in the base frame and, in metres along it, where the plane is: the tool stays on the normal's side."""


def parse_plane(text: str) -> PlaneNumbers:
    """Return the numbers of a text such as 0,0,1,0.05.

    Raises:
        ValueError: there are not four numbers.
    """
    try:
        x, y, z, offset_m = map(float, text.split(","))
    except ValueError:
        raise ValueError(f"plane: expected nx,ny,nz,offset such as 0,0,1,0.05, got {text[:40]!r}") from None
    return x, y, z, offset_m


def planes_of(planes: Iterable[PlaneNumbers]) -> tuple[Plane, ...]:
    """Return planes with normals of length 1.

    Raises:
        ValueError: a number is not finite, or a normal has no length.
    """
    return tuple(_plane(*numbers) for numbers in planes)


def _plane(x: float, y: float, z: float, offset_m: float) -> Plane:
    length = math.hypot(x, y, z)
    if not math.isfinite(length) or not math.isfinite(offset_m) or length < 1e-6:
        raise ValueError(f"plane: expected a normal with a length and an offset in metres, got {x},{y},{z},{offset_m}")
    return Plane(normal=(x / length, y / length, z / length), offset_m=offset_m)
