import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.pose import (
    Pose,
    interpolate_pose,
    point_dist,
    pose_add,
    pose_dist,
    pose_inv,
    pose_of,
    pose_sub,
    pose_trans,
    rotation_matrix,
    rotation_vector,
    rotvec_from_rpy,
    rpy_from_rotvec,
    wrench_trans,
)

HALF = math.pi / 2
IDENTITY = Pose(0, 0, 0, 0, 0, 0)

metres = st.floats(-10, 10)
angles = st.floats(-3, 3)
rotvecs = st.tuples(angles, angles, angles)
poses = st.builds(Pose, metres, metres, metres, angles, angles, angles)


def homogeneous(pose):
    T = np.eye(4)
    T[:3, :3] = rotation_matrix(pose[3:])
    T[:3, 3] = pose[:3]
    return T


def rodrigues(rotvec):
    """The matrix by another formula than the code's."""
    angle = np.linalg.norm(rotvec)
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(rotvec) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def assert_same_frame(first, second):
    np.testing.assert_allclose(homogeneous(first), homogeneous(second), atol=1e-9)


@given(rotvecs)
def test_a_rotation_vector_gives_rodrigues_matrix(rotvec):
    np.testing.assert_allclose(rotation_matrix(rotvec), rodrigues(rotvec), atol=1e-12)


@given(rotvecs)
def test_matrix_to_rotation_vector_and_back_is_the_same_matrix(rotvec):
    R = rotation_matrix(rotvec)
    again = rotation_vector(R)
    assert math.hypot(*again) <= math.pi + 1e-12
    np.testing.assert_allclose(rotation_matrix(again), R, atol=1e-9)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0, -0.6, 0.8)])
@pytest.mark.parametrize("angle", [0, 1e-200, 1e-12, 1e-6, 1, math.pi - 1e-9, math.pi])
def test_the_rotation_vector_survives_nothing_and_half_a_turn(axis, angle):
    rotvec = np.array(axis) * angle
    again = np.array(rotation_vector(rotation_matrix(rotvec)))
    is_turned_over = angle > 3 and np.dot(again, rotvec) < 0  # half a turn left is half a turn right
    np.testing.assert_allclose(-again if is_turned_over else again, rotvec, atol=1e-8)


@given(poses, poses)
def test_pose_trans_multiplies_the_matrices(T_ab, T_bc):
    np.testing.assert_allclose(homogeneous(pose_trans(T_ab, T_bc)), homogeneous(T_ab) @ homogeneous(T_bc), atol=1e-9)


@given(poses)
def test_a_pose_times_its_inverse_is_the_identity(T_ab):
    assert_same_frame(pose_trans(T_ab, pose_inv(T_ab)), IDENTITY)
    assert_same_frame(pose_trans(pose_inv(T_ab), T_ab), IDENTITY)


@given(poses, poses, poses)
def test_pose_trans_is_associative(T_ab, T_bc, T_cd):
    assert_same_frame(pose_trans(pose_trans(T_ab, T_bc), T_cd), pose_trans(T_ab, pose_trans(T_bc, T_cd)))


@given(poses, poses)
def test_what_pose_sub_finds_brings_start_to_end(start, to):
    change = pose_sub(to, start)
    np.testing.assert_allclose(np.add(change[:3], start[:3]), to[:3], atol=1e-9)
    R = np.array(rotation_matrix(change[3:])) @ rotation_matrix(start[3:])
    np.testing.assert_allclose(R, rotation_matrix(to[3:]), atol=1e-9)


def test_pose_trans_by_hand():
    turned = pose_trans(Pose(1, 0, 0, 0, 0, HALF), Pose(2, 0, 0, 0, 0, HALF))
    assert turned == pytest.approx((1, 2, 0, 0, 0, math.pi))


def test_pose_add_by_hand_adds_places_in_the_base_frame():
    assert pose_add(Pose(1, 0, 0, 0, 0, HALF), Pose(2, 0, 0, 0, 0, 0)) == pytest.approx((3, 0, 0, 0, 0, HALF))


def test_distances_by_hand():
    far = Pose(3, 4, 0, 0, 0, 0)
    assert point_dist(IDENTITY, far) == 5
    assert pose_dist(IDENTITY, far) == pytest.approx(5)
    assert pose_dist(IDENTITY, Pose(0, 0, 0, 0, HALF, 0)) == pytest.approx(HALF)


@given(poses, poses)
def test_interpolation_begins_at_the_start_and_ends_at_the_end(start, to):
    assert_same_frame(interpolate_pose(start, to, 0.0), start)
    assert_same_frame(interpolate_pose(start, to, 1.0), to)


@given(poses, poses, st.floats(0, 1))
def test_interpolation_turns_at_one_speed(start, to, alpha):
    whole = math.hypot(*pose_sub(to, start)[3:])
    part = math.hypot(*pose_sub(interpolate_pose(start, to, alpha), start)[3:])
    assert part == pytest.approx(alpha * whole, abs=1e-6)


@given(rotvecs)
def test_rpy_and_back_is_the_same_rotation(rotvec):
    np.testing.assert_allclose(
        rotation_matrix(rotvec_from_rpy(rpy_from_rotvec(rotvec))), rotation_matrix(rotvec), atol=1e-7
    )


@pytest.mark.parametrize("pitch", [HALF, -HALF])
def test_rpy_at_the_poles_keeps_the_rotation(pitch):
    rotvec = rotvec_from_rpy((0.3, pitch, 0.7))
    again = rpy_from_rotvec(rotvec)
    np.testing.assert_allclose(rotation_matrix(rotvec_from_rpy(again)), rotation_matrix(rotvec), atol=1e-7)


def test_rpy_by_hand():
    assert rpy_from_rotvec((HALF, 0, 0)) == pytest.approx((HALF, 0, 0))
    R = np.array(rotation_matrix(rotvec_from_rpy((0.1, 0.2, 0.3))))
    np.testing.assert_allclose(R, rodrigues((0, 0, 0.3)) @ rodrigues((0, 0.2, 0)) @ rodrigues((0.1, 0, 0)), atol=1e-12)


def test_a_wrench_by_hand():
    # 10 N upwards at a; b is one metre along x, so the force acts at x = -1 m and turns by +10 Nm about y.
    assert wrench_trans(Pose(1, 0, 0, 0, 0, 0), (0, 0, 10, 0, 0, 0)) == pytest.approx((0, 0, 10, 0, 10, 0))
    # b's x points along a's y.
    assert wrench_trans(Pose(0, 0, 0, 0, 0, HALF), (0, 5, 0, 0, 0, 1)) == pytest.approx((5, 0, 0, 0, 0, 1))


@given(poses, st.tuples(*[st.floats(-100, 100)] * 6))
def test_a_wrench_there_and_back_is_the_same(T_ab, wrench):
    there = wrench_trans(T_ab, wrench)
    np.testing.assert_allclose(wrench_trans(pose_inv(T_ab), there), wrench, atol=1e-7)


@pytest.mark.parametrize("n", [0, 5, 7])
def test_a_pose_needs_six_numbers(n):
    with pytest.raises(ValueError, match=f"six numbers of a pose, got {n}"):
        pose_of([0.0] * n)
