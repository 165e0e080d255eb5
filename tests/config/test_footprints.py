"""Worst-case clearances: hand-worked cases, and no draw comes nearer."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.footprints import Footprint, clearance_m, footprint_of_box, footprint_of_button
from config.scenario import Box, Button, Lid

METRES = st.floats(-0.5, 0.5)
SIZES = st.floats(0.0, 0.2)
PRINTS = st.builds(
    Footprint,
    centre_m=st.tuples(METRES, METRES),
    spread_m=st.tuples(SIZES, SIZES),
    half_m=st.tuples(SIZES, SIZES),
    radius_m=SIZES,
)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ({"half_m": (0.1, 0.1)}, {"centre_m": (0.3, 0.0), "half_m": (0.1, 0.1)}, 0.1),
        ({"radius_m": 0.1}, {"centre_m": (0.3, 0.4), "radius_m": 0.1}, 0.3),
        ({"half_m": (0.1, 0.1)}, {"centre_m": (0.4, 0.5), "radius_m": 0.2}, 0.3),
        ({"half_m": (0.1, 0.1)}, {"centre_m": (0.15, 0.0), "half_m": (0.1, 0.1)}, -0.05),
        ({"half_m": (0.1, 0.1), "spread_m": (0.02, 0.0)}, {"centre_m": (0.3, 0.0), "half_m": (0.1, 0.1)}, 0.08),
        ({"radius_m": 0.1}, {"radius_m": 0.1}, -0.2),
    ],
    ids=["side by side", "circles", "corner and circle", "overlapping", "spread", "one on the other"],
)
def test_clearance_of_hand_worked_cases(a, b, expected):
    still = {"centre_m": (0.0, 0.0), "spread_m": (0.0, 0.0)}
    first, second = Footprint(**(still | a)), Footprint(**(still | b))
    assert clearance_m(first, second) == pytest.approx(expected)
    assert clearance_m(second, first) == pytest.approx(expected)


@given(PRINTS, PRINTS, st.integers(0, 2**32 - 1))
def test_no_draw_of_two_things_comes_nearer_than_their_clearance(a, b, seed):
    rng = np.random.default_rng(seed)
    least = clearance_m(a, b)
    for _ in range(20):
        centres = [np.array(thing.centre_m) + rng.choice([-1, 1, 0.3], 2) * thing.spread_m for thing in (a, b)]
        gaps = np.abs(centres[0] - centres[1]) - a.half_m - b.half_m
        apart = math.hypot(*np.maximum(gaps, 0.0))
        drawn = (apart if apart > 0 else float(gaps.max())) - a.radius_m - b.radius_m
        assert drawn >= least - 1e-12


def test_leaves_that_open_past_the_vertical_lean_over_the_walls():
    common = {"name": "box", "position_m": (0, 0), "colour": (0, 0, 0), "inner_m": (0.19, 0.15), "wall_m": 0.01}
    box = Box(**common, lid=Lid(output=0))
    upright = Box(**common, lid=Lid(output=0, open_angle_rad=1.5))
    assert footprint_of_box(box, with_leaves=False).half_m == pytest.approx((0.105, 0.085))
    assert footprint_of_box(box, with_leaves=True).half_m == pytest.approx((0.105 - 0.1 * math.cos(1.85), 0.085))
    assert footprint_of_box(upright, with_leaves=True).half_m == pytest.approx((0.105, 0.085))


def test_a_button_covers_its_cap_and_rim():
    button = Button(name="b", position_m=(0.3, 0.1), spread_m=(0.02, 0), colour=(0, 0, 0), input=0, lamp_output=0)
    assert footprint_of_button(button).region_m() == pytest.approx((0.224, 0.044, 0.376, 0.156))
