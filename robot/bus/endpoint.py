"""Where a hub listens, read from its endpoint; and which of these are open to this machine alone."""

import re
from ipaddress import ip_address

import msgspec

from robot.bus.errors import BusConfigError

__all__ = ["Endpoint", "read_endpoint", "safe_endpoint"]

_TCP = re.compile(r"(?P<by>tcp|tls)/(?:\[(?P<six>[0-9a-fA-F:]+)\]|(?P<host>[A-Za-z0-9._-]+)):(?P<port>[0-9]{1,5})")
_LOCAL = re.compile(r"unixsock-stream/(?P<path>/[A-Za-z0-9._/-]{1,100})")
_LAST_PORT = 65535


class Endpoint(msgspec.Struct, frozen=True, kw_only=True):
    """An endpoint in its parts."""

    text: str
    host: str = ""
    port: int = 0
    path: str = ""
    """Of a socket in the file system; host and port are empty then."""
    is_tls: bool = False


def read_endpoint(text: str) -> Endpoint:
    """Return the parts of an endpoint such as tcp/127.0.0.1:7447.

    Raises:
        BusConfigError: it is none.
    """
    found = _TCP.fullmatch(text)
    if found and 0 < int(found["port"]) <= _LAST_PORT:
        host = found["six"] or found["host"]
        return Endpoint(text=text, host=host, port=int(found["port"]), is_tls=found["by"] == "tls")
    local = _LOCAL.fullmatch(text)
    if local:
        return Endpoint(text=text, path=local["path"])
    raise BusConfigError(
        "bus: expected an endpoint such as tcp/127.0.0.1:7447, tls/HOST:7447 or unixsock-stream//run/autotelic.sock, "
        f"got {text!r}"
    )


def safe_endpoint(text: str, *, has_keys: bool) -> Endpoint:
    """Return the parts of an endpoint that nobody comes to who should not.

    Args:
        text: such as tcp/127.0.0.1:7447, which this machine alone can reach, or tls/192.168.1.5:7447.
        has_keys: the rig has certificates.

    Raises:
        BusConfigError: it is none, or others could reach it; or it asks for certificates that there are not.
    """
    endpoint = read_endpoint(text)
    if endpoint.is_tls != has_keys:
        wanted = "certificates (`keys:` in the rig's file; `autotelic keys init` makes them)"
        raise BusConfigError(
            f"bus: expected {wanted} for {text}, there are none"
            if endpoint.is_tls
            else f"bus: expected an endpoint that asks for the rig's certificates (tls/HOST:PORT), got {text}"
        )
    if endpoint.is_tls or endpoint.path or endpoint.host == "localhost" or _is_loopback(endpoint.host):
        return endpoint
    raise BusConfigError(
        f"bus: expected an endpoint on loopback (tcp/127.0.0.1:7447, unixsock-stream//path), got {text}; whoever "
        "reached that could write anything: off this machine take tls/HOST:PORT and certificates (`autotelic keys`)"
    )


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
