"""Colours of lines that stay apart on paper and for people who do not see red from green. Pure.

After Okabe and Ito 2008, "Color Universal Design", without their yellow, which no thin line on white should have.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["PALETTE", "Colour", "like", "oklab"]

Colour = tuple[float, float, float]
"""Red, green and blue in [0, 1], as screens have them (sRGB)."""


def _of(hex_digits: str) -> Colour:
    red, green, blue = bytes.fromhex(hex_digits)
    return red / 255, green / 255, blue / 255


PALETTE: tuple[Colour, ...] = tuple(
    map(_of, ("0072b2", "d55e00", "009e73", "e69f00", "cc79a7", "56b4e9", "000000"))
)  # fmt: skip
"""Blue, vermilion, bluish green, orange, reddish purple, sky blue, black."""


def like(wanted: Sequence[Colour]) -> list[Colour]:
    """Return for each colour one of the palette, together as near to those as can be; one comes again after seven.

    Nearness is distance in Oklab, where it is about what people see.
    """
    from scipy.optimize import linear_sum_assignment  # seconds that most commands do not need

    given: list[Colour] = []
    for begin in range(0, len(wanted), len(PALETTE)):
        part = oklab(wanted[begin : begin + len(PALETTE)])  # (k, 3)
        distances = np.linalg.norm(part[:, None] - oklab(PALETTE), axis=-1)  # (k, 7)
        _, columns = linear_sum_assignment(distances)
        given += [PALETTE[column] for column in columns]
    return given


def oklab(colours: Sequence[Colour]) -> NDArray[np.float64]:
    """Return colours as lightness, green to red, blue to yellow (Ottosson 2020).  (n, 3) -> (n, 3)"""
    coded = np.asarray(colours, dtype=np.float64).reshape(-1, 3)
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return np.cbrt(linear @ _TO_CONES.T) @ _TO_LAB.T


_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
