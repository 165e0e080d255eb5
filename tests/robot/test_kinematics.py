import math

import msgspec
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import load_arm
from robot.chain import ToolChain
from robot.description import arm_model, forward_kinematics, tool_down
from robot.downward import DownwardArm
from robot.kinematics import Kinematics, UnreachableError

ARM = load_arm("ur5e")
KINEMATICS = Kinematics(ARM)
CHAIN = ToolChain(ARM)
MODEL = arm_model(ARM)
JOINTS = st.tuples(*[st.floats(-3.1, 3.1)] * 6)
LOW, HIGH = np.array(ARM.motion.workspace_m)


def ur_table(q):
    """UR's published table, written out once more: the tool of a joint vector."""
    rows = [
        (0, 0.1625, math.pi / 2),
        (-0.425, 0, 0),
        (-0.3922, 0, 0),
        (0, 0.1333, math.pi / 2),
        (0, 0.0997, -math.pi / 2),
        (0, 0.0996 + 0.1628, 0),
    ]
    T = np.eye(4)
    for (a, d, alpha), t in zip(rows, q, strict=True):
        c, s, ca, sa = math.cos(t), math.sin(t), math.cos(alpha), math.sin(alpha)
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    return T


@given(JOINTS)
def test_the_fast_chain_is_the_published_table_to_a_micrometre(q):
    T = ur_table(q)
    assert np.allclose(CHAIN.tcp(q), T[:3, 3], atol=1e-6)
    (tcp, flange, _), down = CHAIN.points(q)
    assert np.allclose(tcp, T[:3, 3], atol=1e-6)
    assert np.allclose(flange, T[:3, 3] - ARM.tool.tcp_m[2] * T[:3, 2], atol=1e-6)
    assert down == pytest.approx(-T[2, 2], abs=1e-6)


@given(JOINTS)
def test_the_description_and_the_simulated_arm_agree_with_the_chain(q):
    assert np.allclose(forward_kinematics(ARM, q)[:3, 3], CHAIN.tcp(q), atol=1e-6)
    data = mujoco.MjData(MODEL)
    for joint, value in zip(ARM.joints, q, strict=True):
        data.joint(joint.name).qpos[0] = value
    mujoco.mj_kinematics(MODEL, data)
    assert np.allclose(data.site("tcp").xpos, CHAIN.tcp(q), atol=1e-6)


@given(JOINTS)
def test_placo_agrees_with_the_chain(q):
    robot, lo = KINEMATICS._robot, KINEMATICS._offset
    robot.state.q[lo : lo + 6] = q
    robot.update_kinematics()
    assert np.allclose(robot.get_T_world_frame("tcp")[:3, 3], CHAIN.tcp(q), atol=1e-6)


@given(JOINTS)
def test_the_chains_quaternion_is_the_tables_rotation(q):
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, np.array(CHAIN.quat(q)))
    assert np.allclose(R.reshape(3, 3), ur_table(q)[:3, :3], atol=1e-9)


@pytest.mark.parametrize("yaw", [None, 0.5, -0.7])
def test_the_inverse_brings_the_tool_down_everywhere_in_the_workspace(yaw):
    rng = np.random.default_rng(3)
    for _ in range(100):
        x, y, z = rng.uniform(LOW, HIGH).tolist()
        q = KINEMATICS.solve((x, y, z), ARM.home_rad, yaw_rad=yaw)
        T = forward_kinematics(ARM, q)
        assert np.allclose(T[:3, 3], (x, y, z), atol=1e-5)
        assert np.allclose(T[:3, :3], tool_down(ARM.tool_yaw_rad if yaw is None else yaw), atol=1e-4)
        assert all(j.range_rad[0] <= v <= j.range_rad[1] for j, v in zip(ARM.joints, q, strict=True))


def test_the_same_question_has_the_same_answer_whatever_was_asked_between():
    other = Kinematics(ARM)
    rng = np.random.default_rng(4)
    for _ in range(20):
        x, y, z = rng.uniform(LOW, HIGH).tolist()
        first = KINEMATICS.solve((x, y, z), ARM.home_rad)
        KINEMATICS.solve((0.3, 0.2, 0.1), ARM.home_rad, yaw_rad=0.3)
        assert KINEMATICS.solve((x, y, z), ARM.home_rad) == first == other.solve((x, y, z), ARM.home_rad)


@pytest.mark.parametrize("where", [(2.0, 0.0, 0.1), (0.0, 0.0, 0.2), (math.nan, 0.0, 0.2), (math.inf, 0.0, 0.2)])
def test_what_cannot_be_reached_is_said_and_does_not_spoil_the_next_answer(where):
    before = KINEMATICS.solve((0.42, 0.0, 0.2), ARM.home_rad)
    with pytest.raises(UnreachableError, match="reach"):
        KINEMATICS.solve(where, ARM.home_rad)
    assert KINEMATICS.solve((0.42, 0.0, 0.2), ARM.home_rad) == before


def test_loading_prints_nothing(capfd):
    Kinematics(ARM)
    assert capfd.readouterr().out == ""


@given(
    st.tuples(*[st.floats(a, b) for a, b in zip(LOW.tolist(), HIGH.tolist(), strict=True)]),
    st.floats(-1.0, 1.0),
    st.tuples(*[st.floats(-0.02, 0.02)] * 6),
)
def test_the_closed_form_gives_placos_answer(place, turn, off):
    yaw = ARM.tool_yaw_rad + turn
    try:
        expected = KINEMATICS.solve(place, ARM.home_rad, yaw_rad=yaw)
    except UnreachableError:
        return
    seed = tuple(a + b for a, b in zip(expected, off, strict=True))
    found = DownwardArm(ARM).solve(place, yaw, seed)
    assert found is not None
    assert np.allclose(found, expected, rtol=0.0, atol=1e-4)  # placo's own tolerance is 1e-5 m
    T = forward_kinematics(ARM, found)
    assert np.allclose(T[:3, 3], place, atol=1e-9)
    assert np.allclose(T[:3, :3], tool_down(yaw), atol=1e-9)


@given(JOINTS.filter(lambda q: abs(math.sin(q[4])) > 0.1 and abs(math.sin(q[2])) > 0.05))
def test_the_closed_form_keeps_to_its_seeds_side_and_turns(q):
    side = math.copysign(1.0, math.sin(q[4]))
    upright = (q[0], q[1], q[2], side * math.pi / 2 - q[1] - q[2], side * math.pi / 2, q[5])
    T = forward_kinematics(ARM, upright)
    away = T[0, 3] * math.cos(q[0]) + T[1, 3] * math.sin(q[0])
    if abs(away) < 0.01:
        return  # over the base, where either shoulder may be meant
    yaw = math.atan2(T[1, 0], T[0, 0])
    found = DownwardArm(ARM).solve(tuple(T[:3, 3].tolist()), yaw, upright)
    assert found == pytest.approx(upright, abs=1e-6)


@pytest.mark.parametrize("broken", [(math.nan, 0.0, 0.3), (math.inf, 0.0, 0.3), (3.0, 0.0, 0.3), (0.01, 0.0, 0.3)])
def test_where_no_joints_lead_the_closed_form_has_no_answer(broken):
    assert DownwardArm(ARM).solve(broken, 0.0, ARM.home_rad) is None
    with pytest.raises(UnreachableError):
        Kinematics(ARM, is_swift=True).solve(broken, ARM.home_rad)


def test_an_arm_of_another_build_has_no_closed_form():
    assert DownwardArm.fits(ARM)
    joints = list(ARM.joints)
    joints[3] = msgspec.structs.replace(joints[3], alpha_rad=0.1)
    assert not DownwardArm.fits(msgspec.structs.replace(ARM, joints=tuple(joints)))
