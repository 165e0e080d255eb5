"""The primary interface, as far as it tells the software and what the arm is made of: calibrated DH, limits set on it.

Layout: UR, "Remote control via TCP/IP" (client interfaces): a package is a uint32 size and a uint8 type; robot state
(type 16) is a sequence of sub-packages of the same form. What greets a client is a robot message (type 20): a uint64
stamp, a source, a type (3), a counted name, and the version as two uint8 and two int32. A key message (type 7) has a
code and an argument (int32), a counted title and a text. Numbers are big-endian.
"""

import socket
import struct
from collections.abc import Callable, Sequence

import msgspec

from robot.errors import WireError
from robot.hal.ur_calls import what_to_try
from robot.messages import Vec6

__all__ = [
    "PRIMARY_PORT",
    "ArmFacts",
    "KeyMessage",
    "parse_facts",
    "parse_greeting",
    "parse_key",
    "parse_tool",
    "read_facts",
    "split_packages",
]

PRIMARY_PORT = 30001
ROBOT_STATE, JOINTS, CARTESIAN, KINEMATICS, CONFIGURATION = 16, 1, 4, 5, 6
ROBOT_MESSAGE, VERSION, KEY = 20, 3, 7
JOINT_BYTES = 41
LARGEST = 1 << 16
_HEADER = struct.Struct(">IB")
_VEC6 = struct.Struct(">6d")
_DOUBLE = struct.Struct(">d")
_RANGES = struct.Struct(">12d")
_MESSAGE, _NUMBERS = struct.Struct(">QbBB"), struct.Struct(">BBi")
_KEY = struct.Struct(">QbBiiB")


class ArmFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What one arm is made of, joints base to wrist 3."""

    theta_rad: Vec6
    a_m: Vec6
    d_m: Vec6
    alpha_rad: Vec6
    q_min_rad: Vec6
    q_max_rad: Vec6
    qd_max_rad_s: Vec6
    q_rad: Vec6
    """Where the joints were when it told."""
    tcp_pose: Vec6
    """Where it said its tool was, at the same instant: metres and a rotation vector, base frame."""
    tcp_offset: Vec6
    """The tool that is set now, in the flange frame, likewise."""


def parse_facts(package: bytes) -> ArmFacts | None:
    """Return the facts in one package, None where it does not carry all of them."""
    if len(package) < _HEADER.size or package[4] != ROBOT_STATE:
        return None
    parts = dict(_sub_packages(package))
    if not {JOINTS, CARTESIAN, KINEMATICS, CONFIGURATION} <= set(parts):
        return None
    kinematics, configuration, cartesian = parts[KINEMATICS], parts[CONFIGURATION], parts[CARTESIAN]
    try:
        theta, a, d, alpha = (_VEC6.unpack_from(kinematics, 24 + 48 * k) for k in range(4))
        ranges = _RANGES.unpack_from(configuration, 0)
        speeds = _RANGES.unpack_from(configuration, 96)
        tcp_pose, tcp_offset = _VEC6.unpack_from(cartesian, 0), _VEC6.unpack_from(cartesian, 48)
        q_rad = _vec6([_DOUBLE.unpack_from(parts[JOINTS], JOINT_BYTES * i)[0] for i in range(6)])
    except struct.error as error:
        raise WireError(f"primary interface: expected kinematics and configuration in full, {error}") from error
    return ArmFacts(
        theta_rad=theta, a_m=a, d_m=d, alpha_rad=alpha,
        q_min_rad=_every_other(ranges, 0), q_max_rad=_every_other(ranges, 1), qd_max_rad_s=_every_other(speeds, 0),
        q_rad=q_rad, tcp_pose=tcp_pose, tcp_offset=tcp_offset,
    )  # fmt: skip


def parse_greeting(package: bytes) -> tuple[int, ...] | None:
    """Return the software's version, major, minor and bugfix, if a package is what greets a client."""
    at = _HEADER.size
    if len(package) < at + _MESSAGE.size or package[4] != ROBOT_MESSAGE:
        return None
    _, _, kind, n_name = _MESSAGE.unpack_from(package, at)
    at += _MESSAGE.size + n_name
    if kind != VERSION or len(package) < at + _NUMBERS.size:
        return None
    return _NUMBERS.unpack_from(package, at)


class KeyMessage(msgspec.Struct, frozen=True, kw_only=True):
    """What a controller tells as it happens, such as that a program was started."""

    title: str
    text: str


def parse_key(package: bytes) -> KeyMessage | None:
    """Return a key message, None where a package is something else."""
    at = _HEADER.size
    if len(package) < at + _KEY.size or package[4] != ROBOT_MESSAGE:
        return None
    _, _, kind, _, _, n_title = _KEY.unpack_from(package, at)
    if kind != KEY:
        return None
    at += _KEY.size
    title, text = package[at : at + n_title], package[at + n_title :]
    return KeyMessage(title=title.decode("utf-8", "replace"), text=text.decode("utf-8", "replace"))


def parse_tool(package: bytes) -> Vec6 | None:
    """Return the tool that is set, in the flange frame; None where a package does not carry it."""
    if len(package) < _HEADER.size or package[4] != ROBOT_STATE:
        return None
    cartesian = dict(_sub_packages(package)).get(CARTESIAN, b"")
    return _VEC6.unpack_from(cartesian, _VEC6.size) if len(cartesian) >= 2 * _VEC6.size else None


def split_packages(stream: bytes) -> tuple[list[bytes], bytes]:
    """Return the whole packages at a stream's beginning, and what is left of it.

    Raises:
        WireError: this is no such stream.
    """
    packages, at = [], 0
    while len(stream) - at >= _HEADER.size:
        size, _ = _HEADER.unpack_from(stream, at)
        if not _HEADER.size <= size <= LARGEST:
            raise WireError(f"primary interface: expected a package of 5 to {LARGEST} bytes, came {size}")
        if len(stream) - at < size:
            break
        packages.append(stream[at : at + size])
        at += size
    return packages, stream[at:]


def read_facts(
    host: str,
    *,
    greeted: Callable[[tuple[int, ...]], object] | None = None,
    timeout_s: float = 3.0,
    n_packages: int = 200,
) -> ArmFacts:
    """Connect, listen until the facts come, and disconnect. Sends nothing.

    Args:
        host: host or IP address of the controller.
        greeted: takes the software's version, which comes first, and raises where nothing more is to be asked.
        timeout_s: how long to wait for each answer.
        n_packages: how many to look through.

    Raises:
        WireError: nobody listens, or the facts do not come.
    """
    try:
        with socket.create_connection((host, PRIMARY_PORT), timeout=timeout_s) as link:
            for _ in range(n_packages):
                package = _package(link)
                version = parse_greeting(package)
                if version is not None and greeted is not None:
                    greeted(version)
                facts = parse_facts(package)
                if facts is not None:
                    return facts
    except OSError as error:
        raise WireError(
            f"primary interface: expected an answer at {host}:{PRIMARY_PORT}, got {error}; {what_to_try(str(error))}"
        ) from error
    raise WireError(f"primary interface: expected kinematics within {n_packages} packages, they did not come")


def _package(link: socket.socket) -> bytes:
    head = _exactly(link, _HEADER.size)
    size, _ = _HEADER.unpack(head)
    if not _HEADER.size <= size <= LARGEST:
        raise WireError(f"primary interface: expected a package of 5 to {LARGEST} bytes, came {size}")
    return head + _exactly(link, size - _HEADER.size)


def _exactly(link: socket.socket, n: int) -> bytes:
    chunks = b""
    while len(chunks) < n:
        chunk = link.recv(n - len(chunks))
        if not chunk:
            raise WireError("primary interface: expected a package, the connection was closed by the other side")
        chunks += chunk
    return chunks


def _sub_packages(package: bytes) -> list[tuple[int, bytes]]:
    parts, at = [], _HEADER.size
    while at + _HEADER.size <= len(package):
        size, kind = _HEADER.unpack_from(package, at)
        if size < _HEADER.size:
            break
        parts.append((kind, package[at + _HEADER.size : at + size]))
        at += size
    return parts


def _every_other(values: tuple[float, ...], first: int) -> Vec6:
    return _vec6(values[first::2])


def _vec6(values: Sequence[float]) -> Vec6:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f
