"""What stands on a table as boxes that links and palm keep out of, upright or tilted. Pure maths.

A fixture's blocks are given in its own frame, whose origin is on the table under its middle: one for itself, and for
each leaf of its lid one where the leaf lies or stands, or as wide as all that it sweeps between. A leaf that stands or
moves is there a second time, for the fingers: they may press on a shut lid, but a leaf that they push is elsewhere.
"""

import math
from enum import StrEnum
from functools import lru_cache

import msgspec

from config.scenario import Box, Button, Cylinder
from robot.geometry import rotated, turn_about_vertical
from robot.messages import Quat, Vec3

__all__ = ["AWAY", "Block", "LidState", "fixture_blocks", "posed", "round_block", "widened"]

UPRIGHT: Quat = (1.0, 0.0, 0.0, 0.0)
SWUNG_PAST_RAD = 0.05
"""A leaf that is pushed or stops short swings past its ends by no more."""
KEPT = 256
"""Fixtures with a lid in some state whose blocks are remembered: a leaf on its way takes 0.3 ms."""
N_ANGLES = 65
"""So many places of a leaf on its way; between two its edge bows out by less than 0.1 mm."""


class Block(msgspec.Struct, frozen=True, kw_only=True):
    """A box that links and palm keep out of, metres."""

    name: str
    centre_m: Vec3
    half_m: Vec3
    quat: Quat = UPRIGHT
    is_for_fingers: bool = False
    """The fingers keep out of it, and nothing else does."""


AWAY: Vec3 = (0.0, 0.0, -100.0)
"""Where a block is that nothing is to keep out of."""


class LidState(StrEnum):
    """What is known of a lid's leaves."""

    SHUT = "shut"
    OPEN = "open"
    UNKNOWN = "unknown"
    """They move, or something may hold them up: they are wherever they can be."""


def fixture_blocks(thing: Button | Box, lid: LidState) -> tuple[Block, ...]:
    """Return the blocks of a button or a box in its own frame; a box's lid, if it has one, as it is known to be."""
    return _remembered(thing, lid)


def _fixture_blocks(thing: Button | Box, lid: LidState) -> tuple[Block, ...]:
    if isinstance(thing, Button):
        half = thing.diameter_m / 2.0
        return (_standing(thing.name, (half, half), thing.height_m),)
    inner, wall = thing.inner_m, thing.wall_m
    box = _standing(thing.name, (inner[0] / 2.0 + wall, inner[1] / 2.0 + wall), thing.height_m)
    if thing.lid is None:
        return (box,)
    leaves = _leaf(thing, -1, lid), _leaf(thing, 1, lid)
    return box, *leaves, *[_for_fingers(leaf, lid) for leaf in leaves]


_remembered = lru_cache(maxsize=KEPT)(_fixture_blocks)
"""No decorator: mutants are made of functions without one (docs/mutation.md)."""


def posed(block: Block, position_m: Vec3, quat: Quat) -> Block:
    """Return a fixture's block where the fixture stands, turned about the vertical as that is."""
    turn = turn_about_vertical(quat)
    c, s = math.cos(turn / 2.0), math.sin(turn / 2.0)
    x, y, z = rotated(block.centre_m, (c, 0.0, 0.0, s))
    w, a, b, d = block.quat
    centre = (x + position_m[0], y + position_m[1], z + position_m[2])
    return Block(
        name=block.name, centre_m=centre, half_m=block.half_m, is_for_fingers=block.is_for_fingers,
        quat=(c * w - s * d, c * a - s * b, c * b + s * a, c * d + s * w),
    )  # fmt: skip


def widened(block: Block, position_m: Vec3, spread_m: tuple[float, float]) -> Block:
    """Return an upright block around a fixture's that holds it wherever the fixture is drawn.

    Args:
        block: in the fixture's own frame.
        position_m: middle of the region.
        spread_m: half of its extents along x and y.
    """
    (x, y, z), (px, py, pz) = block.centre_m, position_m
    hx, hy, hz = _around(block)
    half_m = (hx + spread_m[0], hy + spread_m[1], hz)
    return Block(
        name=block.name, centre_m=(x + px, y + py, z + pz), half_m=half_m, is_for_fingers=block.is_for_fingers
    )  # fmt: skip


def round_block(thing: Cylinder, position_m: Vec3, quat: Quat) -> Block:
    """Return the upright block around a cylinder that stands, leans or lies: r |sin| + h/2 |cos| along each axis."""
    size = math.hypot(*quat)
    w, x, y, z = quat
    axis = rotated((0.0, 0.0, 1.0), (w / size, x / size, y / size, z / size))
    radius, half = thing.diameter_m / 2.0, thing.height_m / 2.0
    a, b, c = (radius * math.sqrt(max(0.0, 1.0 - u * u)) + half * abs(u) for u in axis)
    return Block(name=thing.name, centre_m=position_m, half_m=(a, b, c))


def _standing(name: str, half_m: tuple[float, float], height_m: float) -> Block:
    return Block(name=name, centre_m=(0.0, 0.0, height_m / 2.0), half_m=(*half_m, height_m / 2.0))


def _for_fingers(leaf: Block, lid: LidState) -> Block:
    centre_m = AWAY if lid is LidState.SHUT else leaf.centre_m
    name = f"{leaf.name}/standing"
    return Block(name=name, centre_m=centre_m, half_m=leaf.half_m, quat=leaf.quat, is_for_fingers=True)


def _leaf(box: Box, sign: int, state: LidState) -> Block:
    """Return one leaf: the near one (sign -1) is hinged at the wall that looks to -x, the other at +x."""
    assert box.lid is not None, "asked before"
    open_rad = box.lid.open_angle_rad
    if state is LidState.UNKNOWN:
        low, high = -SWUNG_PAST_RAD, open_rad + SWUNG_PAST_RAD
        return _hull([_leaf_at(box, sign, low + k / (N_ANGLES - 1) * (high - low)) for k in range(N_ANGLES)])
    return _leaf_at(box, sign, open_rad if state is LidState.OPEN else 0.0)


def _leaf_at(box: Box, sign: int, angle_rad: float) -> Block:
    """Return a leaf turned up by an angle about its hinge, which is in the middle of the leaf's own thickness."""
    assert box.lid is not None, "asked before"
    thick, padding = box.lid.thickness_m, box.lid.padding_m
    long = (box.inner_m[0] + box.wall_m) / 2.0
    quat = (math.cos(angle_rad / 2.0), 0.0, sign * math.sin(angle_rad / 2.0), 0.0)
    x, y, z = rotated((-sign * long / 2.0, 0.0, padding / 2.0), quat)
    side = "near" if sign < 0 else "far"
    return Block(
        name=f"{box.name}/leaf_{side}",
        centre_m=(x + sign * long, y, z + box.height_m + thick / 2.0),
        half_m=(long / 2.0, box.inner_m[1] / 2.0 + box.wall_m, (thick + padding) / 2.0),
        quat=quat,
    )


def _hull(blocks: list[Block]) -> Block:
    """Return the upright block around others."""
    extents = [(block.centre_m, _around(block)) for block in blocks]
    low = [min(c[i] - h[i] for c, h in extents) for i in range(3)]
    high = [max(c[i] + h[i] for c, h in extents) for i in range(3)]
    x, y, z = ((a + b) / 2.0 for a, b in zip(low, high, strict=True))
    a, b, c = ((v - u) / 2.0 for u, v in zip(low, high, strict=True))
    return Block(name=blocks[0].name, centre_m=(x, y, z), half_m=(a, b, c))


def _around(block: Block) -> Vec3:
    """Return the half extents, along the frame's axes, of a block that may be tilted."""
    x, y, z = block.half_m
    edges = [rotated(edge, block.quat) for edge in ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))]
    a, b, c = (sum(abs(edge[i]) for edge in edges) for i in range(3))
    return a, b, c
