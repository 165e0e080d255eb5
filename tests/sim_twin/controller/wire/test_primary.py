"""Primary packages against UR's layouts, written down here a second time as plain `struct` strings."""

import struct

import pytest

from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.primary import pack_state
from sim_twin.controller.wire.primary_messages import (
    ReportLevel,
    pack_error_code,
    pack_key,
    pack_popup,
    pack_runtime_exception,
    pack_safety_mode,
    pack_text,
    pack_version,
)
from sim_twin.controller.wire.primary_state import (
    AdditionalInfo,
    CartesianInfo,
    ConfigurationData,
    ForceModeData,
    JointData,
    KinematicsInfo,
    MasterboardData,
    PrimaryState,
    RobotModeData,
    ToolData,
)

E_SERIES = ControllerVersion(major=5, minor=11)
CB3 = ControllerVersion(major=3, minor=15, bugfix=8)
A = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
B = (-1.0, -2.0, -3.0, -4.0, -5.0, -6.0)
C = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
LIMITS = tuple((-float(i), float(i)) for i in range(1, 7))
FULL = PrimaryState(
    mode=RobotModeData(
        timestamp_us=2**40,
        is_power_on=True,
        is_protective_stopped=True,
        robot_mode=7,
        control_mode=2,
        speed_scaling=0.5,
    ),
    joints=JointData(q_rad=A, q_target_rad=B, qd_rad_s=C, current_a=A, mode=(253, 252, 251, 250, 249, 248)),
    tool=ToolData(analog_inputs=(1.5, 2.5), output_voltage_v=24, current_a=0.5),
    masterboard=MasterboardData(digital_inputs=5, digital_outputs=131_072, safety_mode=3, operational_mode_selector=1),
    cartesian=CartesianInfo(tcp_pose=A, tcp_offset=B),
    kinematics=KinematicsInfo(
        checksum=(1, 2, 3, 4, 5, 2**32 - 1), dh_theta_rad=A, dh_a_m=B, dh_d_m=C, dh_alpha_rad=A, calibration_status=1
    ),
    configuration=ConfigurationData(
        q_limits_rad=LIMITS, qd_limits_rad_s=A, qdd_limits_rad_s2=B, dh_a_m=A, dh_d_m=B, dh_alpha_rad=C, dh_theta_rad=A
    ),
    force_mode=ForceModeData(wrench=C, dexterity=0.25),
    additional=AdditionalInfo(button_state=1, is_freedrive_enabled=True),
)


def cut(package):
    """Return a package's type and body after checking its size."""
    size, kind = struct.unpack_from(">iB", package)
    assert size == len(package)
    return kind, package[5:]


def parts(package):
    """Return the sub-packages of a robot state by type."""
    kind, body = cut(package)
    assert kind == 16
    found = {}
    while body:
        (size,) = struct.unpack_from(">i", body)
        part, body = body[:size], body[size:]
        kind, inner = cut(part)
        assert kind not in found
        found[kind] = inner
    return found


def message(package):
    """Return a robot message's (time, source, type) and what is said."""
    kind, body = cut(package)
    assert kind == 20
    return struct.unpack_from(">QbB", body), body[10:]


@pytest.mark.parametrize(
    ("version", "sizes"),
    [
        (E_SERIES, [47, 251, 37, 75, 101, 225, 445, 61, 9]),
        (ControllerVersion(major=5, minor=3), [47, 251, 37, 74, 101, 225, 445, 61, 9]),
        (CB3, [47, 251, 37, 72, 101, 225, 445, 61, 8]),
    ],
)
def test_the_parts_have_their_documented_sizes_and_order(version, sizes):
    found = parts(pack_state(FULL, version))
    assert list(found) == list(range(9))
    assert [len(body) + 5 for body in found.values()] == sizes


def test_robot_mode_data():
    numbers = struct.unpack(">Q????????", pack_state(FULL, E_SERIES)[10:26])
    assert numbers[0] == 2**40
    body = parts(pack_state(FULL, E_SERIES))[0]
    assert struct.unpack(">Q7?bB3dB", body) == (
        *(2**40, True, True, True, False, True, False, False, 7, 2),
        *(1.0, 0.5, 1.0, 0),
    )


def test_joint_data():
    body = parts(pack_state(FULL, E_SERIES))[1]
    rows = list(struct.iter_unpack(">dddffffB", body))
    assert [row[0] for row in rows] == list(A)
    assert [row[1] for row in rows] == list(B)
    assert [row[2] for row in rows] == list(C)
    assert rows[0][3:] == (1.0, 48.0, 25.0, 0.0, 253)
    assert [row[-1] for row in rows] == [253, 252, 251, 250, 249, 248]


def test_tool_and_masterboard_data():
    found = parts(pack_state(FULL, E_SERIES))
    assert struct.unpack(">BBddfBffB", found[2]) == (0, 0, 1.5, 2.5, 48.0, 24, 0.5, 25.0, 253)
    numbers = struct.unpack(">iiBBddbbddffffBBbIBBB", found[3])
    assert numbers[:2] == (5, 131_072)
    assert numbers[14:] == (3, 0, 0, 0, 1, 0, 0)


def test_cartesian_and_kinematics_info():
    found = parts(pack_state(FULL, E_SERIES))
    assert struct.unpack(">12d", found[4]) == (*A, *B)
    assert struct.unpack(">6I24dI", found[5]) == (1, 2, 3, 4, 5, 2**32 - 1, *A, *B, *C, *A, 1)


def test_configuration_data():
    numbers = struct.unpack(">12d12d5d24d4i", parts(pack_state(FULL, E_SERIES))[6])
    assert numbers[:12] == (-1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6)
    assert numbers[12:24] == (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6)
    assert numbers[24:29] == (1.05, 1.4, 0.25, 1.2, 0.25)
    assert numbers[29:53] == (*A, *B, *C, *A)
    assert numbers[53:] == (0, 0, 1, 2)


def test_force_mode_and_additional_info():
    found = parts(pack_state(FULL, E_SERIES))
    assert struct.unpack(">7d", found[7]) == (*C, 0.25)
    assert found[8] == b"\x01\x01\x00\x00"


def test_a_part_that_is_not_known_is_left_out():
    found = parts(pack_state(PrimaryState(mode=FULL.mode, cartesian=FULL.cartesian), E_SERIES))
    assert list(found) == [0, 4]


def test_the_version_message():
    head, said = message(pack_version(E_SERIES, stamp_us=9, build_date="01-02-2021"))
    assert head[0] == 9
    assert head[2] == 3
    assert said[:10] == b"\x09URControl"
    assert struct.unpack_from(">BBii", said, 10) == (5, 11, 0, 108249)
    assert said[20:] == b"01-02-2021"


def test_an_error_code():
    head, said = message(pack_error_code(153, 1, stamp_us=1, level=ReportLevel.VIOLATION, text="x", source=100))
    assert head == (1, 100, 6)
    assert struct.unpack(">iiiIIc", said) == (153, 1, 3, 0, 0, b"x")


def test_a_key_message():
    head, said = message(pack_key(7, 2, stamp_us=1, title="PROGRAM_XXX_STARTED", text="rtde_control"))
    assert head[2] == 7
    assert said == struct.pack(">iiB", 7, 2, 19) + b"PROGRAM_XXX_STARTEDrtde_control"


def test_a_runtime_exception():
    head, said = message(pack_runtime_exception(12, 3, "type_error", stamp_us=1))
    assert head[2] == 10
    assert said == struct.pack(">ii", 12, 3) + b"type_error"


def test_a_popup():
    head, said = message(
        pack_popup("Popup", "hello", stamp_us=1, request_id=4, is_warning=True, is_error=False, is_blocking=True)
    )
    assert head[2] == 2
    assert said == struct.pack(">IB???B", 4, 0, True, False, True, 5) + b"Popuphello"


def test_a_safety_mode_and_a_text():
    head, said = message(pack_safety_mode(0, 0, stamp_us=1, safety_mode=3))
    assert head[2] == 5
    assert struct.unpack(">iiBII", said) == (0, 0, 3, 0, 0)
    head, said = message(pack_text("hello", stamp_us=1))
    assert head[2] == 0
    assert said == b"hello"


def test_a_title_is_cut_at_what_its_length_byte_can_tell():
    _, said = message(pack_key(0, stamp_us=1, title="x" * 300, text=""))
    assert said[8] == 255
    assert len(said) == 9 + 255
