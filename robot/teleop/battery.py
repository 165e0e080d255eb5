"""The battery: every stream has a number, and a number with a seed is always the same stream."""

from collections.abc import Iterator

import msgspec
import numpy as np

from robot.teleop import aimed, creeping, hostile, human, weighing
from robot.teleop.asks import Arena, Ask, Look, Maker
from robot.teleop.search import Candidates, played

__all__ = ["FAMILIES", "Battery", "Place", "Search"]

FAMILIES: dict[str, Maker] = {
    maker.__name__: maker
    for maker in (
        hostile.steps, hostile.chirps, hostile.not_finite, hostile.malformed, hostile.backwards, hostile.bursts,
        hostile.silences, hostile.random_walk, hostile.random_headings, hostile.random_joints, hostile.gate_jumps,
        hostile.mixed, aimed.at_the_box, aimed.at_the_fences, aimed.at_the_joints, aimed.at_the_singular,
        aimed.at_the_things, aimed.circles, aimed.fast_joints, aimed.full_speed, aimed.gate_at_places,
        aimed.gate_grips, aimed.gate_presses, aimed.grasps, aimed.reversals, aimed.tilts, human.reaches,
        human.presses, human.hesitations, creeping.gate_creeps, creeping.gate_leans, creeping.gate_hands,
        weighing.gate_weighs,
    )
}  # fmt: skip
LATE = ("gate_creeps", "gate_leans", "gate_hands", "gate_weighs")
"""Families that came later: they have the last numbers of those that stand alone, so that no other's changed."""
LATE_SHARE = 20
"""One stream in so many is theirs."""
SEARCH_SHARE = 8
"""One stream in so many is a search's."""


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Where a number stands in a battery."""

    number: int
    family: str
    plant: int
    """Which of the plants it is sent to."""


class Search(msgspec.Struct, frozen=True, kw_only=True):
    """A block of streams that learn from one another how to come nearest to one limit."""

    first: int
    n_streams: int
    target: int
    """Which limit, counted round."""
    plant: int


class Battery:
    """Numbers to streams.

    Args:
        seed: of everything that is drawn.
        n_streams: how many there are.
        n_plants: how many plants they are spread over, the same families to each.
    """

    def __init__(self, *, seed: int, n_streams: int, n_plants: int) -> None:
        self._seed, self._n_plants = seed, n_plants
        self._names = tuple(name for name in FAMILIES if name not in LATE)
        self.n_streams = n_streams
        n_search = n_streams // SEARCH_SHARE // Candidates.BLOCK * Candidates.BLOCK
        self._n_plain = n_streams - n_search
        self._first_late = self._n_plain - self._n_plain // LATE_SHARE

    @property
    def n_plain(self) -> int:
        """Streams that stand alone: numbers 0 to this; those from here on belong to searches."""
        return self._n_plain

    def place(self, number: int) -> Place:
        """Return family and plant of a stream that stands alone."""
        names = self._names if number < self._first_late else LATE
        return Place(number=number, family=names[number % len(names)], plant=number // len(names) % self._n_plants)

    def searches(self) -> tuple[Search, ...]:
        """Return the blocks of streams that search."""
        size = Candidates.BLOCK
        firsts = range(self._n_plain, self.n_streams, size)
        return tuple(
            Search(first=first, n_streams=size, target=i, plant=i % self._n_plants) for i, first in enumerate(firsts)
        )

    def stream(self, number: int, look: Look, arena: Arena) -> Iterator[Ask]:
        """Return a stream that stands alone."""
        maker = FAMILIES[self.place(number).family]
        return maker(look, arena, self.rng(number))

    def rng(self, number: int) -> np.random.Generator:
        """Return the chance of one number."""
        return np.random.default_rng([self._seed, number])

    @staticmethod
    def play(knots: np.ndarray, look: Look, arena: Arena) -> Iterator[Ask]:
        """Return the stream that a search's candidate stands for."""
        return played(knots, look, arena)
