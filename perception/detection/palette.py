"""Which things a pixel's colour may belong to: one look-up a pixel, made once from what was learnt."""

import numpy as np
from numpy.typing import NDArray

from config.scenario import Scenario
from perception.calibration.lens import Array
from perception.detection.colour_file import ColourFile, distances
from perception.detection.colours import features
from robot.compiled import Bits2, Bytes3, compiled

__all__ = ["Palette"]

BITS = 6
N = 1 << BITS
FARTHEST = 4.0**2
"""Squared standard deviations from a colour's middle; what is farther is something else."""


class Palette:
    """A table of all colours, 64 levels a channel: bit i is set where thing i may have it.

    A colour is a thing's where it is near what was learnt of it, and nearer than to what may be behind it: the table,
    anything named that is not of the scenario, and boxes behind cylinders. Things that look alike keep both their bits:
    place and size tell them apart.
    """

    def __init__(self, colours: ColourFile, scenario: Scenario) -> None:
        things = [t.name for t in (*scenario.buttons, *scenario.cylinders)]
        named = {t: 1 << i for i, t in enumerate(things)}
        levels = (np.arange(N) + 0.5) / N
        cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=3).reshape(-1, 3)
        seen = features(cube)
        apart = {m: distances(m, seen) for m in colours.models}
        boxes, loose = {b.name for b in scenario.boxes}, {c.name for c in scenario.cylinders}
        behind = _nearest([d for m, d in apart.items() if m.name not in boxes | named.keys()], len(cube))
        behind_loose = np.minimum(behind, _nearest([d for m, d in apart.items() if m.name in boxes], len(cube)))
        bits = np.zeros(len(cube), np.uint32)
        for model, d in apart.items():
            if model.name in named:
                rival = behind_loose if model.name in loose else behind
                bits[(d < FARTHEST) & (d < rival)] |= named[model.name]
        self._bits = bits.reshape(1, -1)
        self._bit_by_name = named

    def label(self, picture: NDArray[np.uint8], gains: Array) -> NDArray[np.uint32]:
        """Return the bits of each pixel, its channels multiplied by gains first.  (h, w, 3), (3,) -> (h, w)"""
        levels = np.minimum(np.arange(256)[:, None] * gains / 256.0 * N, N - 1).astype(np.uint32)
        shifted = np.ascontiguousarray(levels << np.array([2 * BITS, BITS, 0], np.uint32))
        return labelled(picture, shifted, self._bits)

    def bit(self, name: str) -> int:
        """Return a button's or cylinder's bit."""
        return self._bit_by_name[name]


@compiled
def labelled(picture: Bytes3, levels: Bits2, bits: Bits2) -> Bits2:
    """Return the bits of each pixel: its channels' levels (256, 3) say together where in a row of bits to look."""
    height, width, _ = picture.shape
    found = np.empty((height, width), np.uint32)
    for i in range(height):
        for j in range(width):
            k = levels[picture[i, j, 0], 0] + levels[picture[i, j, 1], 1] + levels[picture[i, j, 2], 2]
            found[i, j] = bits[0, k]
    return found


def _nearest(distances: list[Array], n: int) -> Array:
    """Return the least of several distances of n colours; infinite where there is none.  -> (n,)"""
    return np.min(distances, axis=0) if distances else np.full(n, np.inf)
