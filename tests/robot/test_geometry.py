import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.description import tool_down
from robot.geometry import inside_box, tool_offset, turn_about_vertical

SMALL = st.floats(-1.0, 1.0)
POINT = st.tuples(SMALL, SMALL, SMALL)


@given(POINT, POINT, st.floats(-3.0, 3.0))
def test_the_tool_offset_is_the_point_in_the_tools_own_frame(point, tcp, yaw):
    R_bt = tool_down(yaw)
    assert np.allclose(tool_offset(point, tcp, yaw), R_bt.T @ np.subtract(point, tcp), atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [0, 1])
def test_a_point_on_a_face_is_inside_and_the_next_float_is_not(axis, side):
    box = ((-1.0, -2.0, -3.0), (1.0, 2.0, 3.0))
    point = [0.0, 0.0, 0.0]
    point[axis] = box[side][axis]
    assert inside_box(tuple(point), *box)
    point[axis] = math.nextafter(point[axis], math.inf if side else -math.inf)
    assert not inside_box(tuple(point), *box)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_is_not_a_number_is_never_inside(axis):
    point = [0.0, 0.0, 0.0]
    point[axis] = math.nan
    assert not inside_box(tuple(point), (-1.0,) * 3, (1.0,) * 3)


@given(st.floats(-3.1, 3.1))
def test_the_turn_about_the_vertical_is_read_back_from_a_quaternion(yaw):
    assert turn_about_vertical((math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))) == pytest.approx(yaw)
    # A tool that points down, turned by yaw: Rz(yaw) after half a turn about x.
    assert turn_about_vertical((0.0, math.cos(yaw / 2), math.sin(yaw / 2), 0.0)) == pytest.approx(yaw)
