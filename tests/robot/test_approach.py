"""Steps of a target yield to walls: continuous in the direction asked for, in full where they lead away."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from config.loader import resolve
from robot.kinematics import Kinematics, UnreachableError
from robot.motion.approach import Approach, Wall, links_of, singular_room, yielding
from robot.safety import Braking, Clearance, Hard

RESOLVED = resolve()
ARM = RESOLVED.arm
angles = st.floats(-math.pi, math.pi)
rooms = st.floats(-0.01, 0.05)


def _step(angle, length=0.02):
    return [length * math.cos(angle), length * math.sin(angle), 0.0]


@given(angle=angles, wall=angles, room=rooms)
def test_a_step_away_or_along_is_done_in_full(angle, wall, room):
    slope = (math.cos(wall), math.sin(wall), 0.0)
    leads = sum(s * x for s, x in zip(slope, _step(angle), strict=True))
    left, blamed = yielding(_step(angle), [Wall("w", room, slope)])
    if leads >= max(0.0, -room):
        assert left == _step(angle)
        assert blamed is None


@given(angle=angles, by=st.floats(-1e-3, 1e-3), wall=angles, room=rooms)
def test_a_small_turn_of_the_direction_changes_the_step_a_little(angle, by, wall, room):
    walls = [Wall("w", room, (math.cos(wall), math.sin(wall), 0.0))]
    one, _ = yielding(_step(angle), walls)
    other, _ = yielding(_step(angle + by), walls)
    assert math.dist(one, other) <= math.dist(_step(angle), _step(angle + by)) + 1e-12


@given(angle=angles, wall=angles, room=st.floats(0.0, 0.05))
def test_no_step_takes_more_than_its_share_of_the_room(angle, wall, room):
    slope = (math.cos(wall), math.sin(wall), 0.0)
    left, _ = yielding(_step(angle), [Wall("w", room, slope)])
    assert -sum(s * x for s, x in zip(slope, left, strict=True)) <= 0.5 * room + 1e-12
    assert math.hypot(*left) <= 0.02 + 1e-12


@pytest.mark.parametrize(("room", "is_changed"), [(0.04, False), (math.nextafter(0.04, 0.0), True)])
def test_half_the_room_passes_and_the_next_float_does_not(room, is_changed):
    left, _ = yielding([-0.02, 0.0, 0.0], [Wall("w", room, (1.0, 0.0, 0.0))])
    assert (left != [-0.02, 0.0, 0.0]) is is_changed


@pytest.mark.parametrize(
    ("q", "which"),
    [
        ((0.0, -1.0, 0.0, 0.0, -1.5, 0.0), 0),
        ((0.0, -1.0, math.pi, 0.0, -1.5, 0.0), 0),
        ((0.0, -1.0, 1.0, 0.0, 0.0, 0.0), 1),
        ((0.0, -1.0, 1.0, 0.0, math.pi, 0.0), 1),
    ],
)
def test_elbow_and_wrist_have_no_room_at_their_singularities(q, which):
    assert singular_room(links_of(ARM), q)[which] == pytest.approx(0.0, abs=1e-12)


@given(q=st.tuples(*[angles] * 6))
def test_the_three_rooms_make_the_determinant_of_the_tool_s_jacobian(q):
    import numpy as np

    elbow, wrist, shoulder = singular_room(links_of(ARM), q)
    J = CLEARANCE.tool_jacobian(q)
    links = abs(ARM.joints[1].a_m * ARM.joints[2].a_m)
    assert abs(np.linalg.det(J)) == pytest.approx(links * elbow * wrist * shoulder, abs=1e-9)


CLEARANCE = Clearance(ARM, RESOLVED.scenario, hard=Hard())
KINEMATICS = Kinematics(ARM)


def _joints_at(place, seed):
    try:
        return KINEMATICS.solve(place, seed)
    except UnreachableError:
        return None


@pytest.fixture
def approach():
    return Approach(ARM, CLEARANCE, braking=Braking())


def test_a_step_over_the_free_table_is_left_alone(approach):
    at = (0.45, 0.0, 0.225)
    asked = (0.46, 0.01, 0.225)
    assert approach.clear_place(at, asked, now_rad=_joints_at(at, ARM.home_rad), joints_at=_joints_at) == (asked, None)


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.5), (0.7, 0.7, 0.3)])
def test_an_arm_is_not_stretched_flat_and_comes_back_at_full_speed(direction):
    motion = replace(ARM.motion, workspace_m=((-1.0, -1.0, 0.0), (1.0, 1.0, 1.0)))
    approach = Approach(replace(ARM, motion=motion), CLEARANCE, braking=Braking())
    at, long = (0.45, 0.0, 0.4), math.hypot(*direction)
    now = _joints_at(at, ARM.home_rad)
    names = set()
    for _ in range(60):
        asked = tuple(x + 0.02 * d / long for x, d in zip(at, direction, strict=True))
        at, because = approach.clear_place(at, asked, now_rad=now, joints_at=_joints_at)
        now = _joints_at(at, now)
        names.add(because)
    assert "singularity" in names
    assert singular_room(links_of(ARM), now)[0] >= 0.3 - 2e-3
    back = tuple(x - 0.02 * d / long for x, d in zip(at, direction, strict=True))
    assert approach.clear_place(at, back, now_rad=now, joints_at=_joints_at) == (back, None)


def test_joints_that_would_run_the_arm_into_itself_stop_short(approach):
    q = ARM.home_rad
    for _ in range(40):
        asked = (q[0], q[1], q[2] + 0.1, q[3], q[4], q[5])
        q, because = approach.clear_joints(q, asked)
    assert because == "clearance"
    assert 0.0 <= CLEARANCE.gap(q) < 0.02
