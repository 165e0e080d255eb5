"""What the arm keeps clear of, by now: things where they were perceived last, lids as they are known to be."""

import math

from config.scenario import Button, Cylinder, Scenario
from robot.geometry import rotated, turn_about_vertical
from robot.messages import Vec3
from robot.safety.blocks import AWAY, Block, LidState, fixture_blocks, posed, round_block, widened
from robot.safety.lids import LidWatch
from robot.surroundings import Place, Surroundings

__all__ = ["MOVED_M", "Obstacles", "blocks_of"]

MOVED_M = 5e-4
"""What moved by less has not moved, and blocks of what was perceived are so much wider."""
TURNED = 1e-3
NOWHERE = Place(position_m=AWAY, quat=(1.0, 0.0, 0.0, 0.0))
"""Of what is in the hand: it goes where the hand goes."""


class Obstacles:
    """The blocks of one table. State: where each thing was perceived last, and each lid.

    A thing that is not perceived now stays where it was last; one that never was since `seed` is as wide as the region
    that the scenario may draw it from.

    Attributes:
        blocks: Of every thing in the scenario's order, buttons, boxes, cylinders; a lid's leaves follow their box.
        unseen: Names of the things that are not perceived now.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._things = (*scenario.buttons, *scenario.boxes, *scenario.cylinders)
        self._table_m = scenario.table.height_m
        self._boxes = {box.name: box for box in scenario.boxes}
        n = len(scenario.buttons)
        self._lids = {n + k: LidWatch(box) for k, box in enumerate(scenario.boxes) if box.lid is not None}
        self._loose = range(n + len(scenario.boxes), len(self._things))
        self._outputs, self._is_settled = -1, False
        self._forget()

    def seed(self, digital_out: int, now_ns: int) -> None:
        """Forget what was perceived: somebody may have laid the table out."""
        for lid in self._lids.values():
            lid.seed(digital_out, now_ns)
        self._outputs, self._is_settled = digital_out, self._are_settled()
        self._forget()

    def perceive(self, seen: Surroundings) -> bool:
        """Take note of what is perceived now. Returns whether a block was changed."""
        self._is_full = seen.is_hand_full
        is_hidden = self._held is not None and seen.places[self._held] is None
        if not (seen.is_hand_full and seen.held is None and is_hidden):  # what a hand holds it may hide
            self._held = seen.held
        changed: list[int] = []
        for i, place in enumerate(seen.places):
            if place is not None:
                self._seen[i] = place
            where = NOWHERE if i == self._held else self._seen[i]
            if where is not None and _has_moved(self._placed[i], where):
                self._placed[i] = where
                changed.append(i)
        self.unseen = tuple([thing.name for thing, place in zip(self._things, seen.places, strict=True) if not place])
        return self._renew(changed)

    def watch(self, digital_out: int, tcp_m: Vec3, now_ns: int) -> bool:
        """Take note of the outputs of one tick, for the lids. Returns whether a block was changed.

        Args:
            digital_out: what is asked of the outputs.
            tcp_m: the tool centre point: leaves that the hand may hold up are not known to arrive.
            now_ns: the arm's time.
        """
        if self._is_settled and digital_out == self._outputs:
            return False
        self._outputs = digital_out
        changed: list[int] = []
        for i, lid in self._lids.items():
            if lid.state is LidState.UNKNOWN and self._is_held_up(i, lid, tcp_m):
                lid.hold_up(now_ns)
            if lid.note(digital_out, now_ns):
                changed.append(i)
        self._is_settled = self._are_settled()
        return self._renew(changed)

    def _forget(self) -> None:
        n = len(self._things)
        self._held: int | None = None
        self._is_full = False
        self._seen: list[Place | None] = [None] * n
        self._placed: list[Place | None] = [None] * n
        self.unseen = tuple(thing.name for thing in self._things)
        self._of = [self._blocks(i) for i in range(n)]
        self.blocks = tuple(block for blocks in self._of for block in blocks)

    def _are_settled(self) -> bool:
        return all(lid.state is not LidState.UNKNOWN for lid in self._lids.values())

    def _renew(self, changed: list[int]) -> bool:
        if changed:
            for i in changed:
                self._of[i] = self._blocks(i)
            self.blocks = tuple([block for blocks in self._of for block in blocks])
        return bool(changed)

    def _blocks(self, i: int) -> tuple[Block, ...]:
        """Return a thing's blocks, where it was perceived or wherever it may be drawn."""
        thing, place = self._things[i], self._placed[i]
        if isinstance(thing, Cylinder):
            return (self._drawn(thing) if place is None else _wider(round_block(thing, place.position_m, place.quat)),)
        made = fixture_blocks(thing, self._lids[i].state if i in self._lids else LidState.SHUT)
        if place is None:
            middle_m = (*thing.position_m, self._table_m)
            return tuple([widened(block, middle_m, thing.spread_m) for block in made])
        middle_m = (place.position_m[0], place.position_m[1], self._table_m)
        quat = (1.0, 0.0, 0.0, 0.0) if isinstance(thing, Button) else place.quat
        return tuple([_wider(posed(block, middle_m, quat)) for block in made])

    def _drawn(self, thing: Cylinder) -> Block:
        """Return the block around wherever a cylinder may be drawn, standing."""
        box = self._boxes.get(thing.inside or "")
        (x, y), (sx, sy) = ((0.0, 0.0), (0.0, 0.0)) if box is None else (box.position_m, box.spread_m)
        at_m = (x + thing.position_m[0], y + thing.position_m[1], self._table_m + thing.height_m / 2.0)
        standing = round_block(thing, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        return widened(standing, at_m, (sx + thing.spread_m[0], sy + thing.spread_m[1]))

    def _is_held_up(self, i: int, lid: LidWatch, tcp_m: Vec3) -> bool:
        """Return whether hand or a loose thing may be in the way of a lid's leaves."""
        thing, place = self._things[i], self._placed[i]
        x, y = thing.position_m if place is None else place.position_m[:2]
        half_rad = 0.0 if place is None else turn_about_vertical(place.quat) / 2.0
        back = (math.cos(half_rad), 0.0, 0.0, -math.sin(half_rad))

        def from_middle(at_m: Vec3) -> Vec3:
            return rotated((at_m[0] - x, at_m[1] - y, at_m[2] - self._table_m), back)

        if lid.is_hand_in_way(from_middle(tcp_m), is_full=self._is_full):
            return True
        for k in self._loose:
            loose, where = self._things[k], self._placed[k]
            if isinstance(loose, Cylinder) and where is not None:
                radius_m = math.hypot(loose.diameter_m, loose.height_m) / 2.0
                if lid.is_thing_in_way(from_middle(where.position_m), radius_m):
                    return True
        return False


def blocks_of(scenario: Scenario) -> tuple[Block, ...]:
    """Return the blocks of a table that nobody has looked at yet, its lids shut."""
    table = Obstacles(scenario)
    table.seed(0, 0)
    return table.blocks


def _has_moved(before: Place | None, now: Place) -> bool:
    if before is None:
        return True
    if before is now:
        return False
    turned = max([abs(a - b) for a, b in zip(before.quat, now.quat, strict=True)])
    return math.dist(before.position_m, now.position_m) > MOVED_M or turned > TURNED


def _wider(block: Block) -> Block:
    x, y, z = block.half_m
    half_m = (x + MOVED_M, y + MOVED_M, z + MOVED_M)
    return Block(
        name=block.name, centre_m=block.centre_m, half_m=half_m, quat=block.quat, is_for_fingers=block.is_for_fingers
    )  # fmt: skip
