"""What a UR controller says of itself, read: mode and safety bits, versions, and why it did not do as told. Pure.

Numbers are those of UR's RTDE guide: robot_mode, runtime_state and the bits of safety_status_bits.
"""

import ipaddress
import socket

import msgspec

from robot.errors import ArmRefusedError, RobotConfigError, WireError
from robot.messages import ArmMode, PlantKind

__all__ = [
    "Runtime",
    "UrStatus",
    "check_ready",
    "check_version",
    "is_well",
    "kind_of_address",
    "mode_of",
    "parse_version",
    "why_refused",
    "why_slowed",
]

RUNNING, IDLE, POWER_OFF = 7, 5, 3
OLDEST_MINOR = 6
"""First version of PolyScope 5 whose dashboard tells whether the arm is in remote control."""
FULL_SPEED = 0.99

_ROBOT_MODES = {
    -1: "no controller", 0: "disconnected", 1: "confirm safety", 2: "booting", 3: "power off", 4: "power on",
    5: "idle, brakes on", 6: "backdrive", 7: "running", 8: "updating firmware",
}  # fmt: skip
_SAFETY_BITS = (
    (2, "protective stop"), (4, "safeguard stop"), (5, "system emergency stop"), (6, "robot emergency stop"),
    (7, "emergency stop"), (8, "safety violation"), (9, "safety fault"), (10, "stopped due to safety"), (3, "recovery"),
    (11, "three-position enabling device released"),
)  # fmt: skip
_EMERGENCY = 1 << 5 | 1 << 6 | 1 << 7
_FAULT = 1 << 8 | 1 << 9
_SAFEGUARD = 1 << 4 | 1 << 11
_REDUCED = 1 << 1
_STOPPED = 1 << 2 | 1 << 3 | 1 << 10
"""Bit 10 stands beside that of every stop; alone it is the least that can be said."""


class Runtime:
    """Values of runtime_state."""

    STOPPING, STOPPED, PLAYING, PAUSING, PAUSED, RESUMING = range(6)


class UrStatus(msgspec.Struct, frozen=True, kw_only=True):
    """What the controller said last."""

    robot_mode: int
    safety_bits: int
    runtime: int
    speed_fraction: float = 1.0
    """Of the speed slider and whatever else slows motion down."""


def mode_of(robot_mode: int, safety_bits: int) -> ArmMode:
    """Return our mode for the controller's: of several stops the one that takes most to release."""
    if safety_bits & _EMERGENCY:
        return ArmMode.EMERGENCY_STOP
    if safety_bits & _FAULT:
        return ArmMode.SAFETY_FAULT
    if safety_bits & _SAFEGUARD:
        return ArmMode.SAFEGUARD_STOP
    if safety_bits & _STOPPED:
        return ArmMode.PROTECTIVE_STOP
    if robot_mode == RUNNING:
        return ArmMode.RUNNING
    return ArmMode.IDLE if robot_mode == IDLE else ArmMode.STOPPED


def _mode_in(status: UrStatus) -> ArmMode:
    return mode_of(status.robot_mode, status.safety_bits)


def is_well(status: UrStatus, *, is_ended: bool = False) -> bool:
    """Return whether nothing in a state says why the controller should not obey, but that its program ended perhaps."""
    return _mode_in(status) is ArmMode.RUNNING and (is_ended or status.runtime == Runtime.PLAYING)


def why_refused(status: UrStatus) -> str:
    """Return the most likely reason why the controller did not obey, in words."""
    reasons = [name for bit, name in _SAFETY_BITS if status.safety_bits >> bit & 1]
    if status.robot_mode != RUNNING:
        reasons.append(f"the arm is not running ({_ROBOT_MODES.get(status.robot_mode, status.robot_mode)})")
    if not reasons and status.runtime != Runtime.PLAYING:
        reasons.append("the program on the controller has ended (watchdog, a person, or an error in its log)")
    return ", ".join(reasons) or "no reason is visible in its state; look at the log on the pendant"


def check_ready(status: UrStatus, *, is_remote: bool) -> None:
    """Refuse to take an arm that is not ready, or that somebody else uses.

    Raises:
        ArmRefusedError: not in remote control, not running, stopped by safety, in reduced mode, slowed down, or a
            program runs.
    """
    if not is_remote:
        raise ArmRefusedError("expected the arm in remote control, it is in local: switch it at the top right corner")
    if _mode_in(status) is not ArmMode.RUNNING:
        raise ArmRefusedError(f"expected an arm that runs and is not stopped, came: {why_refused(status)}")
    if status.runtime not in (Runtime.STOPPED, Runtime.STOPPING):
        raise ArmRefusedError("expected no program on the arm, one is running: whoever started it must stop it")
    slowed = why_slowed(status.safety_bits, status.speed_fraction)
    if slowed is not None:
        raise ArmRefusedError(slowed)


def why_slowed(safety_bits: int, speed_fraction: float) -> str | None:
    """Return what keeps the controller from following as fast as it is asked to, in words; None where nothing does."""
    if safety_bits & _REDUCED:
        return (
            "expected the arm in normal mode, it is in reduced mode, whose limits are narrower than those it was "
            "compared with: leave that mode at the cell"
        )
    if speed_fraction < FULL_SPEED:
        percent = round(100 * speed_fraction)
        return f"expected the speed slider at 100 %, it is at {percent} %: motion would trail its targets"
    return None


def parse_version(text: str) -> tuple[int, ...]:
    """Return the numbers of `URSoftware 5.21.0.1234` or alike.

    Raises:
        WireError: there is no version in it.
    """
    for word in text.replace("(", " ").split():
        numbers = word.split(".")
        if len(numbers) >= 3 and all(n.isdigit() for n in numbers):
            return tuple(int(n) for n in numbers)
    raise WireError(f"expected a version from the dashboard, came {text!r}")


def check_version(version: tuple[int, ...]) -> None:
    """Refuse what this backend was never tried with.

    Raises:
        RobotConfigError: not PolyScope 5, or too old.
    """
    if version[0] >= 10:
        raise RobotConfigError("expected PolyScope 5, came PolyScope X: it has no dashboard and no tested gripper port")
    if version[0] != 5 or version[1] < OLDEST_MINOR:
        came = ".".join(map(str, version))
        raise RobotConfigError(f"expected PolyScope 5.{OLDEST_MINOR} or newer of the 5 series, came {came}")


def kind_of_address(address: str) -> PlantKind:
    """Return what stands at an address: on this machine's loopback only a virtual controller can be.

    Raises:
        RobotConfigError: the address leads nowhere.
    """
    try:
        resolved = ipaddress.ip_address(socket.gethostbyname(address))
    except (OSError, ValueError) as error:
        raise RobotConfigError(f"address: expected a host or IP address, came {address!r}: {error}") from error
    return PlantKind.VIRTUAL if resolved.is_loopback else PlantKind.REAL
