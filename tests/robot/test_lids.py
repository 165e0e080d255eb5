"""Where a hand or a loose thing may hold up the leaves of a lid: at each edge it does, and the next float does not."""

import math

import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.safety.lids import HAND_M, HELD_M, TIPS_M, LidWatch

SQUARE = resolve().scenario.boxes[1]
LID = replace(SQUARE.lid, open_angle_rad=math.radians(120.0), thickness_m=0.006, padding_m=0.004)
BOX = replace(SQUARE, inner_m=(0.10, 0.16), wall_m=0.01, height_m=0.08, lid=LID)
HALF_X, HALF_Y, HIGH = 0.0975, 0.09, 0.145
"""Worked by hand: leaves of 55 mm that stand 30 degrees past upright lean out by half of that, and are 10 mm thick."""
TINY = 1e-9
RADIUS = 0.03


def over(at):
    return math.nextafter(at, math.inf)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("axis", "half"), [(0, HALF_X), (1, HALF_Y)])
def test_a_hand_is_in_the_way_as_far_aside_as_its_leaves_and_itself_reach(axis, half, sign):
    lid = LidWatch(BOX)
    for reach, by, is_in_way in ((HAND_M, -TINY, True), (HAND_M, TINY, False)):
        at = [0.0, 0.0, 0.1]
        at[axis] = sign * (half + reach + by)
        assert lid.is_hand_in_way(tuple(at), is_full=False) is is_in_way


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("axis", "half"), [(0, HALF_X), (1, HALF_Y)])
def test_a_thing_is_in_the_way_as_far_aside_as_the_leaves_and_itself_reach(axis, half, sign):
    for by, is_in_way in ((-TINY, True), (TINY, False)):
        at = [0.0, 0.0, 0.1]
        at[axis] = sign * (half + RADIUS + by)
        assert LidWatch(BOX).is_thing_in_way(tuple(at), RADIUS) is is_in_way


@pytest.mark.parametrize(("is_full", "below"), [(False, TIPS_M), (True, HELD_M)])
def test_a_hand_is_in_the_way_up_to_where_what_hangs_from_it_is_over_the_leaves(is_full, below):
    top = BOX.height_m + (BOX.inner_m[0] + BOX.wall_m) / 2.0 + LID.thickness_m + LID.padding_m + below
    assert top == pytest.approx(HIGH + below)
    assert not LidWatch(BOX).is_hand_in_way((0.0, 0.0, top), is_full=is_full)
    assert LidWatch(BOX).is_hand_in_way((0.0, 0.0, math.nextafter(top, 0.0)), is_full=is_full)


def test_a_thing_is_in_the_way_from_the_rim_up_to_over_the_leaves_and_in_the_box_is_not():
    lid = LidWatch(BOX)
    top = BOX.height_m + (BOX.inner_m[0] + BOX.wall_m) / 2.0 + LID.thickness_m + LID.padding_m + RADIUS
    heights = ((math.nextafter(0.08, 0.0), False), (0.08, True), (math.nextafter(top, 0.0), True), (top, False))
    assert [lid.is_thing_in_way((0.0, 0.0, z), RADIUS) for z, _ in heights] == [is_in for _, is_in in heights]


def test_leaves_that_stand_less_than_upright_lean_out_by_their_thickness_alone():
    lid = LidWatch(replace(BOX, lid=replace(LID, open_angle_rad=math.radians(60.0))))
    for by, is_in_way in ((-TINY, True), (TINY, False)):
        assert lid.is_hand_in_way((0.05 + 0.01 + 0.01 + HAND_M + by, 0.0, 0.1), is_full=False) is is_in_way


def test_the_very_edge_aside_is_in_the_way():
    leaf = (BOX.inner_m[0] + BOX.wall_m) / 2.0
    out = leaf * max(0.0, -math.cos(LID.open_angle_rad)) + LID.thickness_m + LID.padding_m
    edges = (BOX.inner_m[0] / 2.0 + BOX.wall_m + out + HAND_M, BOX.inner_m[1] / 2.0 + BOX.wall_m + HAND_M)
    lid = LidWatch(BOX)
    for x, y, is_in_way in ((edges[0], 0.0, True), (over(edges[0]), 0.0, False), (0.0, edges[1], True),
                            (0.0, over(edges[1]), False)):  # fmt: skip
        assert lid.is_hand_in_way((x, y, 0.1), is_full=False) is is_in_way
