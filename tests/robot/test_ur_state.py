"""What a controller says of itself, read; and when it is refused."""

import msgspec
import pytest

from robot.errors import ArmRefusedError, RobotConfigError, WireError
from robot.hal.ur_state import (
    Runtime,
    UrStatus,
    check_ready,
    check_version,
    kind_of_address,
    mode_of,
    parse_version,
    why_refused,
)
from robot.messages import ArmMode, PlantKind

READY = UrStatus(robot_mode=7, safety_bits=1, runtime=Runtime.STOPPED)


def but(**changes):
    return msgspec.structs.replace(READY, **changes)


@pytest.mark.parametrize(
    ("status", "mode"),
    [
        (READY, ArmMode.RUNNING),
        (but(safety_bits=0b10), ArmMode.RUNNING),  # reduced
        (but(robot_mode=5), ArmMode.IDLE),
        (but(robot_mode=3), ArmMode.STOPPED),
        (but(safety_bits=1 << 2 | 1 << 10), ArmMode.PROTECTIVE_STOP),
        (but(safety_bits=1 << 10), ArmMode.PROTECTIVE_STOP),
        (but(safety_bits=1 << 4 | 1 << 10), ArmMode.SAFEGUARD_STOP),
        (but(safety_bits=1 << 11), ArmMode.SAFEGUARD_STOP),
        (but(safety_bits=1 << 2 | 1 << 4 | 1 << 10), ArmMode.SAFEGUARD_STOP),
        (but(safety_bits=1 << 9 | 1 << 10), ArmMode.SAFETY_FAULT),
        (but(safety_bits=1 << 8 | 1 << 4), ArmMode.SAFETY_FAULT),
        (but(safety_bits=1 << 7 | 1 << 9), ArmMode.EMERGENCY_STOP),
        (but(safety_bits=1 << 6 | 1 << 7), ArmMode.EMERGENCY_STOP),
        (but(safety_bits=1 << 2 | 1 << 7), ArmMode.EMERGENCY_STOP),
    ],
)
def test_the_gravest_of_what_it_says_is_its_mode(status, mode):
    assert mode_of(status.robot_mode, status.safety_bits) is mode


@pytest.mark.parametrize(
    ("status", "word"),
    [
        (but(safety_bits=1 << 2), "protective stop"),
        (but(safety_bits=1 << 4), "safeguard"),
        (but(safety_bits=1 << 11), "three-position"),
        (but(safety_bits=1 << 6 | 1 << 7), "emergency"),
        (but(robot_mode=5), "brakes"),
        (but(runtime=Runtime.STOPPED), "program on the controller has ended"),
        (but(runtime=Runtime.PLAYING), "log on the pendant"),
    ],
)
def test_a_refusal_has_a_reason_in_words(status, word):
    assert word in why_refused(status)


def test_an_arm_that_is_ready_is_taken():
    check_ready(READY, is_remote=True)


@pytest.mark.parametrize(
    ("status", "is_remote", "word"),
    [
        (READY, False, "remote control"),
        (but(robot_mode=5), True, "brakes"),
        (but(safety_bits=1 << 2), True, "protective stop"),
        (but(runtime=Runtime.PLAYING), True, "whoever started it"),
        (but(runtime=Runtime.PAUSED), True, "whoever started it"),
        (but(speed_fraction=0.5), True, "50 %"),
        (but(safety_bits=0b10), True, "reduced mode"),
    ],
)
def test_an_arm_that_is_not_ready_or_somebody_elses_is_not_taken(status, is_remote, word):
    with pytest.raises(ArmRefusedError, match=word):
        check_ready(status, is_remote=is_remote)


def test_versions_are_read_and_the_untried_refused():
    assert parse_version("URSoftware 5.11.6.1010150 (Dec 16 2021)") == (5, 11, 6, 1010150)
    check_version((5, 11, 6, 0))
    for version, word in (((10, 8, 0), "PolyScope X"), ((5, 5, 1), "5.6"), ((3, 15, 8), "3.15.8")):
        with pytest.raises(RobotConfigError, match=word):
            check_version(version)
    with pytest.raises(WireError, match="version"):
        parse_version("could not understand")


def test_only_loopback_can_be_virtual():
    assert kind_of_address("127.0.0.2") is PlantKind.VIRTUAL
    assert kind_of_address("localhost") is PlantKind.VIRTUAL
    assert kind_of_address("192.168.1.10") is PlantKind.REAL
    with pytest.raises(RobotConfigError, match="address"):
        kind_of_address("no such host")
