"""All things over pictures: what is believed of each now, how old that is, and whether to trust it."""

import math
from collections.abc import Mapping

import msgspec

from config.scenario import Box, Cylinder, Scenario
from perception.detection.seen import Detections, Stance, ThingSeen
from perception.tracking.held import HeldThing
from perception.tracking.lamp import LampTrack
from perception.tracking.place import Place, PlaceTrack, Steadiness
from robot.messages import ArmState, Quat, Vec3

__all__ = ["TableTracks", "Tracked"]

FIXED = Steadiness(gate_m=0.005, least_weight=0.1, n_agree=3)
LOOSE = Steadiness(gate_m=0.004, least_weight=0.4, n_agree=2)
NEAR_M = 0.11
"""A tool that comes this near to where a loose thing was seen last, along the table, may have moved it."""
MEMORY_NS = 2_000_000_000
"""So long a loose thing is believed to be where it was, with the tool near it."""
LOST_NS, SEARCH_EVERY = 200_000_000, 4
N_GONE = 5
"""So many pictures running must show something else where a loose thing was, before it is taken for gone."""
LAMP_MEMORY_NS = 250_000_000
"""A lamp that was not seen for longer may be in any state."""
UPRIGHT: Quat = (1.0, 0.0, 0.0, 0.0)


class Tracked(msgspec.Struct, frozen=True, kw_only=True):
    """What is believed of one thing, or of one lamp (its place is nowhere then)."""

    position_m: Vec3 = (0.0, 0.0, 0.0)
    quat: Quat = UPRIGHT
    is_lit: bool = False
    age_s: float
    is_valid: bool
    """An entry that is not valid says where a thing was seen last or, where it never was, where it is laid out."""
    confidence: float


class TableTracks:
    """What is believed of one scenario's things, buttons, boxes and cylinders, and of its lamps."""

    def __init__(self, scenario: Scenario) -> None:
        fixed = (*scenario.buttons, *scenario.boxes)
        self._table_m = scenario.table.height_m
        self._cylinders = {c.name: c for c in scenario.cylinders}
        self._places = {thing.name: PlaceTrack(FIXED) for thing in fixed}
        self._places |= {name: PlaceTrack(LOOSE) for name in self._cylinders}
        self._lamps = {button.name: LampTrack() for button in scenario.buttons}
        self._boxes = {box.name: box for box in scenario.boxes}
        self._drawn = _layout(scenario)
        self._held = HeldThing()
        self.forget(0)

    def forget(self, now_ns: int) -> None:
        """Begin anew: the table was laid out by somebody."""
        for track in (*self._places.values(), *self._lamps.values()):
            track.forget()
        self._held.forget()
        self._newest_ns = now_ns
        self._began_ns = now_ns
        self._approached_ns: dict[str, int] = {}
        self._kept: dict[str, Vec3] = {}
        self._let_go_ns: dict[str, int] = {}
        self._n_gone: dict[str, int] = {}

    def note_arm(self, arm: ArmState) -> None:
        """Take in what the arm measured: what its hand holds, and what its tool comes near to."""
        places = self._last_places()
        let_go = self._held.note(arm, places)
        if let_go is not None:
            self._kept[let_go] = self._held.position_m(arm)
            self._let_go_ns[let_go] = arm.stamp_ns
            self._places[let_go].forget()  # it falls: nobody knows where it lies until it is seen
        for name, at in places.items():
            if math.dist(at[:2], arm.tcp_position_m[:2]) < NEAR_M:
                self._approached_ns[name] = arm.stamp_ns

    def note_picture(self, seen: Detections) -> None:
        """Take in what a picture shows; of what the hand holds, or held then, the hand knows better."""
        self._newest_ns = seen.stamp_ns
        for thing in seen.things:
            if thing.name != self._held.name and seen.stamp_ns > self._let_go_ns.get(thing.name, -1):
                self._places[thing.name].note(thing, seen.stamp_ns)
                self._note_gone(thing, seen.stamp_ns)
        for lamp in seen.lamps:
            self._lamps[lamp.name].note(lamp, seen.stamp_ns)

    def _note_gone(self, thing: ThingSeen, stamp_ns: int) -> None:
        """Count pictures that show past a thing's place; after some running nobody knows where it is."""
        place = self._places[thing.name].place
        self._n_gone[thing.name] = self._n_gone.get(thing.name, 0) + 1 if thing.is_gone else 0
        if place is not None and self._n_gone[thing.name] >= N_GONE:
            self._kept[thing.name], self._let_go_ns[thing.name] = place.position_m, stamp_ns
            self._places[thing.name].forget()

    def thing(self, name: str, arm: ArmState) -> Tracked:
        """Return what is believed of a thing at a measurement's time."""
        place = self._places[name].place
        if name == self._held.name:
            quat = UPRIGHT if place is None else self._quat(place)
            return Tracked(
                position_m=self._held.position_m(arm), quat=quat, age_s=0.0, is_valid=True,
                confidence=1.0 if place is None else place.confidence,
            )  # fmt: skip
        if place is None:
            since_ns = self._let_go_ns.get(name, self._began_ns)
            return Tracked(
                position_m=self._where(name), age_s=(arm.stamp_ns - since_ns) / 1e9, is_valid=False, confidence=0.0
            )
        age_ns = max(0, arm.stamp_ns - place.stamp_ns)
        is_untouched = place.stamp_ns >= self._approached_ns.get(name, -1)
        return Tracked(
            position_m=place.position_m, quat=self._quat(place), age_s=age_ns / 1e9,
            is_valid=is_untouched or age_ns <= MEMORY_NS, confidence=place.confidence,
        )  # fmt: skip

    def _where(self, name: str) -> Vec3:
        """Return where a thing that is not seen was let go of or, where it never was, is laid out in its box."""
        if name in self._kept:
            return self._kept[name]
        x, y, z = self._drawn[name]
        box = self._boxes.get(self._cylinders[name].inside or "") if name in self._cylinders else None
        seen = None if box is None else self._places[box.name].place
        if box is None or seen is None:
            return x, y, z
        return x + seen.position_m[0] - box.position_m[0], y + seen.position_m[1] - box.position_m[1], z

    def lamp(self, name: str, now_ns: int) -> Tracked:
        """Return what is believed of a button's lamp."""
        lamp = self._lamps[name]
        if lamp.stamp_ns is None:
            return Tracked(age_s=(now_ns - self._began_ns) / 1e9, is_valid=False, confidence=0.0)
        age_ns = max(0, now_ns - lamp.stamp_ns)
        return Tracked(is_lit=lamp.is_lit, age_s=age_ns / 1e9, is_valid=age_ns <= LAMP_MEMORY_NS, confidence=1.0)

    def near(self, n_pictures: int) -> Mapping[str, Vec3]:
        """Return where to look for things: where they were seen last.

        A loose thing that newer pictures do not show there is looked for all over every few pictures.
        """
        places = {name: track.place for name, track in self._places.items()}
        return {
            name: place.position_m
            for name, place in places.items()
            if place is not None
            and (name not in self._cylinders or self._newest_ns - place.stamp_ns < LOST_NS or n_pictures % SEARCH_EVERY)
        }

    def _last_places(self) -> Mapping[str, Vec3]:
        """Return where loose things were seen last, those that were."""
        return {name: place.position_m for name in self._cylinders if (place := self._places[name].place) is not None}

    def _quat(self, place: Place) -> Quat:
        """Return a standing thing's turn, which does not show, or that of one whose axis lies along the table."""
        if place.stance is not Stance.LYING or place.axis_rad is None:
            return UPRIGHT
        half = math.sqrt(0.5)
        return half, -half * math.sin(place.axis_rad), half * math.cos(place.axis_rad), 0.0


def _layout(scenario: Scenario) -> dict[str, Vec3]:
    """Return where the scenario's file lays each thing out, but for what is drawn about that."""
    table_m = scenario.table.height_m
    boxes = {box.name: box for box in scenario.boxes}
    places: dict[str, Vec3] = {}
    for button in scenario.buttons:
        places[button.name] = (*button.position_m, table_m + button.height_m - button.cap_m / 2.0)
    for box in scenario.boxes:
        places[box.name] = (*box.position_m, table_m)
    for cylinder in scenario.cylinders:
        places[cylinder.name] = _laid_out(cylinder, boxes.get(cylinder.inside or ""), table_m)
    return places


def _laid_out(cylinder: Cylinder, box: Box | None, table_m: float) -> Vec3:
    x, y = cylinder.position_m
    if box is not None:
        x, y = x + box.position_m[0], y + box.position_m[1]
    return x, y, table_m + cylinder.height_m / 2.0
