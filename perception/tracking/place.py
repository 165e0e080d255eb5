"""One thing's place over pictures: it stays where it is until several pictures running say otherwise. State."""

import math

import msgspec

from perception.detection.seen import Stance, ThingSeen
from robot.messages import Vec3

__all__ = ["Place", "PlaceTrack", "Steadiness"]


MUCH = 0.15
"""Of a thing's outline."""


class Steadiness(msgspec.Struct, frozen=True, kw_only=True):
    """How much one kind of thing keeps to its place."""

    gate_m: float
    """What is seen farther off than this is another place, or an error."""
    least_weight: float
    """Of a new picture against all before it."""
    n_agree: int
    """So many pictures must see the same other place before it is believed."""


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """Where a thing was seen last."""

    position_m: Vec3
    stance: Stance
    axis_rad: float | None
    confidence: float
    visible: float
    """Share of its outline that nothing stood before, where the place is from."""
    stamp_ns: int
    """Of the newest picture that agrees."""


class PlaceTrack:
    """Constant position with outlier rejection.

    Attributes:
        place: Where the thing was seen last; None where it was not since the beginning.
    """

    def __init__(self, steadiness: Steadiness) -> None:
        self._steady = steadiness
        self.forget()

    def forget(self) -> None:
        """Begin anew: somebody may have laid the table out."""
        self.place: Place | None = None
        self._n = 0
        self._other: Place | None = None
        self._n_other = 0

    def put(self, place: Place) -> None:
        """Take it that the thing is there now, whatever was seen before."""
        self.place, self._n = place, 1
        self._other, self._n_other = None, 0

    def note(self, seen: ThingSeen, stamp_ns: int) -> None:
        """Take in what one picture shows of the thing."""
        if seen.position_m is None:
            return
        found = Place(
            position_m=seen.position_m, stance=seen.stance, axis_rad=seen.axis_rad, confidence=seen.confidence,
            visible=seen.visible, stamp_ns=stamp_ns,
        )  # fmt: skip
        if self.place is None:
            self.put(found)
        elif self._agrees(self.place, found):
            self._bear_out(self.place, found)
            self._other, self._n_other = None, 0
        else:
            self._doubt(found)

    def _bear_out(self, place: Place, found: Place) -> None:
        """Take in a picture that agrees: a much freer sight stands for itself, a much worse one says "still there".

        What half a silhouette says is off to one side, in every picture alike: a mean does not mend that.
        """
        if found.visible > place.visible + MUCH:
            self.put(found)
        elif found.visible < place.visible - MUCH:
            self.place = msgspec.structs.replace(place, stamp_ns=found.stamp_ns)
        else:
            self._n += 1
            self.place = _mixed(place, found, max(1.0 / self._n, self._steady.least_weight))

    def _doubt(self, found: Place) -> None:
        """Take in a place that is not the one believed."""
        if self._other is not None and self._agrees(self._other, found):
            self._n_other += 1
        else:
            self._n_other = 1
        self._other = found
        if self._n_other >= self._steady.n_agree:
            self.put(found)

    def _agrees(self, place: Place, found: Place) -> bool:
        return place.stance is found.stance and math.dist(place.position_m, found.position_m) <= self._steady.gate_m


def _mixed(place: Place, found: Place, weight: float) -> Place:
    """Return a place drawn towards what was found; stance and axis are the newer ones."""
    (ax, ay, az), (bx, by, bz) = place.position_m, found.position_m
    return Place(
        position_m=(ax + weight * (bx - ax), ay + weight * (by - ay), az + weight * (bz - az)),
        stance=found.stance, axis_rad=found.axis_rad, stamp_ns=found.stamp_ns,
        confidence=place.confidence + weight * (found.confidence - place.confidence),
        visible=max(place.visible, found.visible),
    )  # fmt: skip
