"""The primary interface as our own packers write it, read back; and which arms are refused."""

import math
import socket
from contextlib import suppress
from threading import Thread

import msgspec
import pytest

from config.loader import load_arm
from robot.chain import ToolChain
from robot.errors import RobotConfigError, WireError
from robot.hal.ur_checks import check_facts, check_pose, flange_pose
from robot.hal.ur_primary import PRIMARY_PORT, ArmFacts, parse_facts, parse_greeting, read_facts
from sim_twin.controller.wire.primary import pack_state
from sim_twin.controller.wire.primary_messages import pack_text, pack_version
from sim_twin.controller.wire.primary_state import (
    CartesianInfo,
    ConfigurationData,
    JointData,
    KinematicsInfo,
    PrimaryState,
    RobotModeData,
)
from sim_twin.controller.wire.version import ControllerVersion
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

ARM = load_arm("ur5e")
Q = (0.3, -1.4, 1.7, -1.9, -1.5, 0.4)
VERSION = ControllerVersion(major=5, minor=11, bugfix=6, build=0)


def dh(name):
    return tuple(getattr(j, name) for j in ARM.joints)


def facts(**changes):
    """Facts of an arm that is its file's, standing at Q with our tool set."""
    tcp_offset = (*ARM.tool.tcp_m, 0.0, 0.0, 0.0)
    plain = ArmFacts(
        theta_rad=(0.0,) * 6, a_m=dh("a_m"), d_m=dh("d_m"), alpha_rad=dh("alpha_rad"),
        q_min_rad=(-2 * math.pi,) * 6, q_max_rad=(2 * math.pi,) * 6, qd_max_rad_s=(math.pi,) * 6,
        q_rad=Q, tcp_pose=tool_pose(Q), tcp_offset=tcp_offset,
    )  # fmt: skip
    return msgspec.structs.replace(plain, **changes)


def tool_pose(q):
    chain = ToolChain(ARM)
    w, x, y, z = chain.quat(q)
    angle = 2.0 * math.acos(w)
    share = angle / math.sin(angle / 2.0)
    return (*chain.tcp(q), x * share, y * share, z * share)


def package(told, **parts):
    state = PrimaryState(
        mode=RobotModeData(timestamp_us=1, is_power_on=True, robot_mode=7),
        joints=JointData(q_rad=told.q_rad, q_target_rad=told.q_rad, qd_rad_s=(0.0,) * 6),
        cartesian=CartesianInfo(tcp_pose=told.tcp_pose, tcp_offset=told.tcp_offset),
        kinematics=KinematicsInfo(
            checksum=(0,) * 6, dh_theta_rad=told.theta_rad, dh_a_m=told.a_m, dh_d_m=told.d_m,
            dh_alpha_rad=told.alpha_rad,
        ),
        configuration=ConfigurationData(
            q_limits_rad=tuple(zip(told.q_min_rad, told.q_max_rad, strict=True)), qd_limits_rad_s=told.qd_max_rad_s,
            qdd_limits_rad_s2=(40.0,) * 6, dh_a_m=told.a_m, dh_d_m=told.d_m, dh_alpha_rad=told.alpha_rad,
        ),
    )  # fmt: skip
    return pack_state(msgspec.structs.replace(state, **parts), VERSION)


def test_what_is_packed_is_read_back():
    told = facts(theta_rad=(1e-4, 0, 0, 0, 0, -1e-4))
    assert parse_facts(package(told)) == told


def test_a_package_without_all_of_it_is_passed_over_and_a_torn_one_is_an_error():
    assert parse_facts(package(facts(), kinematics=None)) is None
    assert parse_facts(b"\x00\x00\x00\x05\x14") is None
    assert parse_facts(b"") is None
    whole = package(facts())
    at = whole.index(b"\x06", 5)
    with pytest.raises(WireError, match="in full"):
        parse_facts(whole[: at + 100])


def test_the_arms_own_kinematics_bring_its_joints_to_its_tool():
    check_facts(facts(), ARM)
    check_pose(facts())
    assert flange_pose(facts(), Q)[:3, 3] == pytest.approx(
        [a - b for a, b in zip(ToolChain(ARM).tcp(Q), _along_z(Q, ARM.tool.tcp_m[2]), strict=True)], abs=1e-9
    )


def _along_z(q, length):
    w, x, y, z = ToolChain(ARM).quat(q)
    axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    return [length * v for v in axis]


def test_a_calibrated_arm_is_accepted_and_its_own_numbers_are_used():
    # A tenth of a milliradian in the shoulder moves a stretched tool by less than 0.1 mm; a whole one is seen.
    check_facts(facts(alpha_rad=(math.pi / 2 + 1e-3, *dh("alpha_rad")[1:])), ARM)
    with pytest.raises(RobotConfigError, match="mm"):
        check_pose(facts(alpha_rad=(math.pi / 2 + 1e-3, *dh("alpha_rad")[1:])))


def test_joints_whose_zeros_are_off_by_what_a_calibration_takes_are_accepted():
    check_facts(facts(theta_rad=(1e-3, -1e-3, 1e-3, -1e-3, 1e-3, 1e-3)), ARM)


def test_offsets_shifted_along_parallel_axes_are_a_calibration_of_the_same_model():
    check_facts(facts(d_m=(0.1625, -12.4, 8.1, 4.3 + 0.1333, 0.0997, 0.0996)), ARM)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"a_m": (0.0, -0.612, -0.5723, 0.0, 0.0, 0.0)}, "another model"),  # a UR10
        ({"d_m": (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)}, "expected d1 of"),
        ({"d_m": (0.1625, 0.0, 0.0, 0.1533, 0.0997, 0.0996)}, r"d2 \+ d3 \+ d4 of"),
        ({"d_m": (0.1625, 0.0, 0.0, 0.1333, 0.0797, 0.1196)}, "expected d5 of"),
        ({"q_max_rad": (1.0, *(2 * math.pi,) * 5)}, "narrow it"),
        ({"qd_max_rad_s": (1.0,) * 6}, "lower it"),
        ({"q_max_rad": (math.nan, *(2 * math.pi,) * 5)}, "narrow it"),
        ({"qd_max_rad_s": (math.nan,) * 6}, "lower it"),
        ({"theta_rad": (0.0, 0.049, 0.0, 0.0, 0.0, 0.0)}, "mm apart"),
        ({"theta_rad": (math.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0)}, "mm apart"),
        ({"theta_rad": (0.0, 0.0, math.nan, 0.0, 0.0, 0.0)}, "mm apart"),
    ],
)
def test_another_arm_or_narrower_limits_are_refused(changes, word):
    with pytest.raises(RobotConfigError, match=word):
        check_facts(facts(**changes), ARM)


def test_nobody_there_is_said():

    with socket.socket() as taken:
        taken.bind(("127.0.4.9", 0))
        with pytest.raises(WireError, match=r"127\.0\.4\.9:30001"):
            read_facts("127.0.4.9", timeout_s=0.2)


def test_the_greeting_tells_the_version_and_nothing_else_does():
    greeting = pack_version(VERSION, stamp_us=7)
    assert parse_greeting(greeting) == (5, 11, 6)
    assert parse_greeting(pack_text("\x03 5.11", stamp_us=7)) is None
    assert parse_greeting(package(facts())) is None
    assert parse_greeting(greeting[:24]) is None


@pytest.fixture
def polyscope_x():
    """The primary port of a controller that has neither dashboard nor gripper port, and otherwise the same arm."""
    host, told = own_address(), pack_version(ControllerVersion(major=10, minor=8), stamp_us=1) + package(facts())
    with socket.create_server((host, PRIMARY_PORT)) as listener:

        def serve():
            with suppress(OSError):  # nobody comes, or whoever came leaves with half of it unread
                link, _ = listener.accept()
                with link:
                    link.sendall(told)
                    link.recv(1)

        listener.settimeout(10.0)
        server = Thread(target=serve)
        server.start()
        yield host
        server.join()


def test_polyscope_x_is_refused_with_the_reason_before_its_missing_dashboard_is_asked(polyscope_x):
    rtde = pytest.importorskip("robot.hal.rtde", reason="the genuine client comes with `pip install autotelic[lab]`")
    with pytest.raises(RobotConfigError, match="PolyScope X"):
        rtde.RtdeArm(arm=ARM, address=polyscope_x).connect()


def test_a_walk_through_its_wires_is_refused_at_polyscope_x_with_the_reason_too(polyscope_x):
    terminals = pytest.importorskip("robot.hal.ur_terminals", reason="the genuine client comes with autotelic[lab]")
    with pytest.raises(RobotConfigError, match="PolyScope X"):
        terminals.UrTerminals(polyscope_x).__enter__()
