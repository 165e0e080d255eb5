"""Where a hub listens, read from its endpoint; and which of these are open to this machine alone."""

import re
from ipaddress import ip_address

import msgspec

from robot.bus.errors import BusConfigError

__all__ = ["Endpoint", "on_loopback", "read_endpoint"]

_TCP = re.compile(r"tcp/(?:\[(?P<six>[0-9a-fA-F:]+)\]|(?P<host>[A-Za-z0-9._-]+)):(?P<port>[0-9]{1,5})")
_LOCAL = re.compile(r"unixsock-stream/(?P<path>/[A-Za-z0-9._/-]{1,100})")
_LAST_PORT = 65535


class Endpoint(msgspec.Struct, frozen=True, kw_only=True):
    """An endpoint in its parts."""

    text: str
    host: str = ""
    port: int = 0
    path: str = ""
    """Of a socket in the file system; host and port are empty then."""


def read_endpoint(text: str) -> Endpoint:
    """Return the parts of an endpoint such as tcp/127.0.0.1:7447.

    Raises:
        BusConfigError: it is none.
    """
    found = _TCP.fullmatch(text)
    if found and 0 < int(found["port"]) <= _LAST_PORT:
        return Endpoint(text=text, host=found["six"] or found["host"], port=int(found["port"]))
    local = _LOCAL.fullmatch(text)
    if local:
        return Endpoint(text=text, path=local["path"])
    raise BusConfigError(
        f"bus: expected an endpoint such as tcp/127.0.0.1:7447 or unixsock-stream//run/autotelic.sock, got {text!r}"
    )


def on_loopback(text: str) -> Endpoint:
    """Return the parts of an endpoint that this machine alone can reach.

    Raises:
        BusConfigError: it is none, or others could reach it.
    """
    endpoint = read_endpoint(text)
    if endpoint.path or endpoint.host == "localhost" or _is_loopback(endpoint.host):
        return endpoint
    raise BusConfigError(
        f"bus: expected an endpoint on loopback (tcp/127.0.0.1:7447, unixsock-stream//path), got {text}; "
        "whoever reached that could write anything, and certificates that would keep them out are not there yet"
    )


def _is_loopback(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
