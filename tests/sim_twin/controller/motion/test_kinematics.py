import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from config.loader import resolve
from robot.chain import ToolChain
from robot.description import forward_kinematics
from sim_twin.controller.motion.kinematics import (
    ArmKinematics,
    DhRow,
    KinematicsError,
    NoSolutionError,
    SingularError,
    calibrated,
    dh_rows,
)
from sim_twin.controller.motion.poses import (
    between,
    matrix_from_pose,
    pose_from_matrix,
    pose_inv,
    pose_trans,
    rotation,
    rotation_vector,
)

ARM = resolve().arm
NOMINAL = dh_rows(ARM)
TCP = (0.01, -0.02, 0.16, 0.1, -0.4, 0.7)
# Deltas of the size that a factory calibration has; the parallel axes' large opposite offsets are left out.
DELTAS = tuple(
    DhRow(a_m=0.0003 * (i - 2), d_m=-0.0002 * i, alpha_rad=0.001 * (i - 3), theta_rad=0.0015 * (2 - i))
    for i in range(6)
)
KINEMATICS = ArmKinematics(NOMINAL)
CALIBRATED = ArmKinematics(NOMINAL, true=calibrated(NOMINAL, DELTAS))

joints = st.lists(st.floats(-3.1, 3.1), min_size=6, max_size=6).map(np.array)
both = st.sampled_from([KINEMATICS, CALIBRATED])


def off(T_a, T_b):
    way, turn = between(T_a, T_b)
    return max(np.linalg.norm(way), np.linalg.norm(turn))


@given(st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3))
def test_a_rotation_vector_comes_back_from_its_rotation(vector):
    assert rotation_vector(rotation(vector)) == pytest.approx(vector, abs=1e-9)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, -0.8, 0), (0, 0.6, -0.8)])
@pytest.mark.parametrize("short_of", [0.0, 1e-9, 1e-4])
def test_half_a_turn_is_no_trouble(axis, short_of):
    vector = np.array(axis) * (np.pi - short_of)
    assert rotation(rotation_vector(rotation(vector))) == pytest.approx(rotation(vector), abs=1e-12)


@given(st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6))
def test_a_pose_times_its_inverse_is_nothing(pose):
    assert pose_trans(pose, pose_inv(pose)) == pytest.approx(np.zeros(6), abs=1e-9)


@given(joints)
def test_the_flange_and_the_tool_are_where_the_rest_of_the_project_has_them(q):
    T_ft = matrix_from_pose((*ARM.tool.tcp_m, 0, 0, 0))
    assert KINEMATICS.forward(q) == pytest.approx(forward_kinematics(ARM, q, frame="flange"), abs=1e-12)
    assert KINEMATICS.forward(q, T_ft)[:3, 3] == pytest.approx(ToolChain(ARM).tcp(tuple(q)), abs=1e-12)


@given(joints, both)
@settings(max_examples=60)
def test_the_inverse_of_a_pose_reaches_it_to_a_nanometre(q, kinematics):
    if abs(np.linalg.det(kinematics.jacobian(q))) < 1e-3:
        return
    pose = kinematics.pose(q, TCP)
    found = kinematics.inverse(pose, q, TCP)
    assert off(kinematics.forward(found, matrix_from_pose(TCP)), matrix_from_pose(pose)) < 1e-9
    assert found == pytest.approx(q, abs=1e-6)


@given(joints)
@settings(max_examples=60)
def test_every_solution_is_one_and_the_nearest_is_chosen(q):
    if abs(np.linalg.det(KINEMATICS.jacobian(q))) < 1e-3:
        return
    T = KINEMATICS.forward(q)
    found = KINEMATICS.solutions(T)
    assert len(found) in (2, 4, 6, 8)
    assert max(off(KINEMATICS.forward(s), T) for s in found) < 1e-7
    for near in found:
        assert KINEMATICS.inverse(pose_from_matrix(T), near) == pytest.approx(near, abs=1e-6)


def test_the_inverse_stays_on_the_turn_that_it_is_near_to():
    q = np.array([3.5, -1.2, 1.4, -1.8, -1.5, -4.2])
    assert KINEMATICS.inverse(KINEMATICS.pose(q), q + 0.01) == pytest.approx(q, abs=1e-8)


@given(joints, both)
@settings(max_examples=40)
def test_the_jacobian_is_the_slope_of_the_pose(q, kinematics):
    T_ft, h = matrix_from_pose(TCP), 1e-6
    J = kinematics.jacobian(q, T_ft)
    for i in range(6):
        step = np.eye(6)[i] * h
        way, turn = between(kinematics.forward(q - step, T_ft), kinematics.forward(q + step, T_ft))
        assert J[:, i] == pytest.approx(np.concatenate([way, turn]) / (2 * h), abs=1e-7)


def test_joint_speeds_give_back_the_tool_speed():
    q, twist = np.array(ARM.home_rad), np.array([0.1, -0.2, 0.05, 0.3, 0.1, -0.2])
    assert KINEMATICS.jacobian(q) @ KINEMATICS.joint_speeds(q, twist) == pytest.approx(twist, abs=1e-12)


@pytest.mark.parametrize("pose", [(1.2, 0, 0.3, 0, 3.1, 0), (0.0, 0.0, 0.3, 0, 3.14159265, 0)])
def test_out_of_reach_has_no_solution(pose):
    q = np.array(ARM.home_rad)
    assert not KINEMATICS.has_solution(pose, q)
    with pytest.raises(NoSolutionError, match="no joint angles"):
        KINEMATICS.inverse(pose, q)


def test_within_reach_has_a_solution():
    q = np.array(ARM.home_rad)
    assert KINEMATICS.has_solution(KINEMATICS.pose(q, TCP), q, TCP)


@pytest.mark.parametrize(
    "q", [(0.3, -1.2, 0.0, -1, -1.5, 0), (0.3, -1.2, 1.4, -1, 0.0, 0), (0, -1.5708, 0, -1.5708, 0, 0)]
)
def test_a_singular_pose_has_a_name(q):
    with pytest.raises(SingularError, match="singular"):
        KINEMATICS.joint_speeds(np.array(q), np.array([0.1, 0.1, 0.1, 0, 0, 0]))


def test_a_straight_wrist_leaves_wrist_3_where_it_is():
    q = np.array([0.3, -1.2, 1.4, -1.0, 0.0, 0.7])
    found = KINEMATICS.inverse(KINEMATICS.pose(q), q)
    assert found == pytest.approx(q, abs=1e-6)


def test_what_is_not_a_number_has_no_solution():
    with pytest.raises((KinematicsError, ValueError)):
        KINEMATICS.inverse((np.nan, 0, 0.4, 0, 3, 0), np.array(ARM.home_rad))
