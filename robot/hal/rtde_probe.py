"""Asks an RTDE port whether anybody answers, before the client does, which would wait for ever.

Protocol: UR, "Real-Time Data Exchange (RTDE) guide": a package is a uint16 size and a uint8 type; a request for
protocol version 2 (type V) is answered by one byte.
"""

import socket
import struct

from robot.errors import WireError

__all__ = ["RTDE_PORT", "probe_rtde"]

RTDE_PORT = 30004
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
