"""The blocks of things: where they lie, and that nothing of a thing sticks out of its own."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from config.loader import resolve
from config.scenario import Lid
from robot.geometry import rotated
from robot.safety.blocks import AWAY, LidState, _leaf_at, fixture_blocks, posed, round_block, widened

SCENARIO = resolve().scenario
BOX = replace(
    SCENARIO.boxes[0], name="x", inner_m=(0.2, 0.1), wall_m=0.006, height_m=0.07,
    lid=Lid(output=3, open_angle_rad=math.pi / 2.0, thickness_m=0.004, padding_m=0.01),
)  # fmt: skip
LONG_M = 0.103
"""From a hinge, in the middle of a wall, to the middle of the box."""
angles = st.floats(-math.pi, math.pi)
TINY_M = 1e-9


def corners(block):
    """The block's corners.  () -> (8, 3)"""
    signs = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return np.array([rotated(tuple(np.multiply(s, block.half_m).tolist()), block.quat) for s in signs]) + block.centre_m


def holds(block, points):
    """Whether an upright block holds points, to a billionth of a metre."""
    assert block.quat == (1.0, 0.0, 0.0, 0.0)
    return bool((np.abs(np.asarray(points) - block.centre_m) <= np.asarray(block.half_m) + TINY_M).all())


def of(state):
    return {block.name: block for block in fixture_blocks(BOX, state)}


def test_a_shut_lid_lies_on_its_box_from_wall_to_middle():
    blocks = of(LidState.SHUT)
    for side, sign in (("near", -1.0), ("far", 1.0)):
        leaf = blocks[f"x/leaf_{side}"]
        assert leaf.quat == (1.0, 0.0, 0.0, 0.0)
        assert leaf.centre_m == pytest.approx((sign * LONG_M / 2.0, 0.0, 0.07 + 0.007))
        assert leaf.half_m == pytest.approx((LONG_M / 2.0, 0.056, 0.007))


def test_an_open_leaf_stands_on_its_hinge_its_padding_outside():
    blocks = of(LidState.OPEN)
    for side, sign in (("near", -1.0), ("far", 1.0)):
        made = corners(blocks[f"x/leaf_{side}"])
        # The hinge is half the leaf's own thickness over the rim; at a right angle the leaf stands on it.
        assert made[:, 2].min() == pytest.approx(0.07 + 0.002, abs=1e-6)
        assert made[:, 2].max() == pytest.approx(0.07 + 0.002 + LONG_M, abs=1e-6)
        out = sign * made[:, 0]
        assert out.min() == pytest.approx(LONG_M - 0.002, abs=1e-6)
        assert out.max() == pytest.approx(LONG_M + 0.012, abs=1e-6)


@given(share=st.floats(0.0, 1.0), sign=st.sampled_from([-1, 1]), open_rad=st.floats(0.6, 2.6))
def test_a_lid_of_which_nothing_is_known_is_wherever_its_leaves_can_be(share, sign, open_rad):
    box = replace(BOX, lid=replace(BOX.lid, open_angle_rad=open_rad))
    near, far = fixture_blocks(box, LidState.UNKNOWN)[1:3]
    block = near if sign < 0 else far
    angle = -0.05 + share * (open_rad + 0.1)
    inside = np.abs(corners(_leaf_at(box, sign, angle)) - block.centre_m) - block.half_m
    assert inside.max() < 1e-4  # between the places that were looked at an edge bows out by less


def test_fingers_may_come_down_on_a_shut_lid_and_on_no_other():
    for state in LidState:
        leaves = {b.name: b for b in fixture_blocks(BOX, state) if not b.is_for_fingers}
        standing = [b for b in fixture_blocks(BOX, state) if b.is_for_fingers]
        assert len(standing) == 2
        for block in standing:
            leaf = leaves[block.name.removesuffix("/standing")]
            assert block.centre_m == (AWAY if state is LidState.SHUT else leaf.centre_m)
            assert (block.half_m, block.quat) == (leaf.half_m, leaf.quat)


def test_a_box_without_a_lid_and_a_button_are_one_block_each():
    (box,) = fixture_blocks(replace(BOX, lid=None), LidState.SHUT)
    assert (box.centre_m, box.half_m) == ((0.0, 0.0, 0.035), pytest.approx((0.106, 0.056, 0.035)))
    (button,) = fixture_blocks(replace(SCENARIO.buttons[0], diameter_m=0.08, height_m=0.04), LidState.SHUT)
    assert (button.centre_m, button.half_m) == ((0.0, 0.0, 0.02), (0.04, 0.04, 0.02))


@given(yaw=angles, state=st.sampled_from(list(LidState)))
def test_a_box_that_is_turned_takes_all_of_its_blocks_with_it(yaw, state):
    quat = (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
    for block in fixture_blocks(BOX, state):
        there = posed(block, (0.4, -0.1, 0.02), quat)
        expected = [rotated(tuple(c), quat) for c in corners(block).tolist()]
        assert corners(there) == pytest.approx(np.add(expected, (0.4, -0.1, 0.02)), abs=1e-6)
        assert (there.name, there.is_for_fingers) == (block.name, block.is_for_fingers)


@given(dx=st.floats(-1.0, 1.0), dy=st.floats(-1.0, 1.0), state=st.sampled_from(list(LidState)))
def test_a_region_holds_a_fixture_wherever_it_is_drawn(dx, dy, state):
    for block in fixture_blocks(BOX, state):
        region = widened(block, (0.4, -0.1, 0.02), (0.03, 0.05))
        assert holds(region, np.add(corners(block), (0.4 + 0.03 * dx, -0.1 + 0.05 * dy, 0.02)))
        assert (region.name, region.is_for_fingers) == (block.name, block.is_for_fingers)


@given(quat=st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1), round_rad=angles)
def test_a_cylinder_is_inside_its_block_however_it_lies(quat, round_rad):
    thing = SCENARIO.cylinders[0]
    size = math.hypot(*quat)
    unit = tuple(q / size for q in quat)
    block = round_block(thing, (0.3, 0.2, 0.1), quat)
    for end in (-1.0, 1.0):
        edge = (math.cos(round_rad) * thing.diameter_m / 2, math.sin(round_rad) * thing.diameter_m / 2)
        point = rotated((*edge, end * thing.height_m / 2), unit)
        assert holds(block, np.add(point, (0.3, 0.2, 0.1)))


def test_a_cylinder_that_stands_is_as_wide_as_it_is_thick_and_one_that_lies_as_long():
    thing = replace(SCENARIO.cylinders[0], diameter_m=0.04, height_m=0.06)
    assert round_block(thing, AWAY, (1.0, 0.0, 0.0, 0.0)).half_m == pytest.approx((0.02, 0.02, 0.03))
    lying = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    assert round_block(thing, AWAY, lying).half_m == pytest.approx((0.02, 0.03, 0.02))
