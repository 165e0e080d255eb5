"""Asks ports whether anybody answers, before the client does: it would wait for ever, or leave something behind.

Protocol: UR, "Real-Time Data Exchange (RTDE) guide": a package is a uint16 size and a uint8 type; a request for
protocol version 2 (type V) is answered by one byte.
"""

import socket
import struct

from robot.errors import WireError
from robot.hal.ur_calls import what_to_try

__all__ = ["RTDE_PORT", "UPLOAD_PORT", "probe_rtde", "probe_upload"]

RTDE_PORT = 30004
UPLOAD_PORT = 30003
"""Where the client sends its program."""
_HEADER = struct.Struct(">HB")
_VERSION = ord("V")
_ASK = _HEADER.pack(5, _VERSION) + b"\x00\x02"


def probe_rtde(host: str, *, timeout_s: float = 2.0) -> None:
    """Connect, ask for the protocol's version, and disconnect.

    Args:
        host: host or IP address of the controller.
        timeout_s: how long to wait for each answer.

    Raises:
        WireError: nobody listens, nobody answers, or the answer is another protocol's.
    """
    where = f"RTDE: expected an answer at {host}:{RTDE_PORT}"
    try:
        with socket.create_connection((host, RTDE_PORT), timeout=timeout_s) as link:
            link.sendall(_ASK)
            answer = b""
            while len(answer) < _HEADER.size + 1:
                chunk = link.recv(_HEADER.size + 1 - len(answer))
                if not chunk:
                    raise WireError(f"{where}, the connection was closed by the other side")
                answer += chunk
    except OSError as error:
        raise WireError(
            f"{where}, got {error or 'none in time'}; is RTDE enabled, and the port open under Security > Services?"
        ) from error
    size, kind = _HEADER.unpack_from(answer)
    if (size, kind, answer[-1]) != (_HEADER.size + 1, _VERSION, 1):
        raise WireError(f"{where} with protocol version 2, came {answer.hex()}")


def probe_upload(host: str, *, timeout_s: float = 2.0) -> None:
    """Connect to the port that takes programs, and disconnect: nothing is sent.

    Raises:
        WireError: nobody listens. Nothing of ours is on the arm then.
    """
    try:
        socket.create_connection((host, UPLOAD_PORT), timeout=timeout_s).close()
    except OSError as error:
        said = f"{error or 'no answer in time'}"
        raise WireError(
            f"program upload: expected an answer at {host}:{UPLOAD_PORT}, got {said}; {what_to_try(said)}"
        ) from error
