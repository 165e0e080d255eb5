"""Zenoh sessions that listen and connect where they are told, and nowhere else."""

import errno
import json
import socket
from collections.abc import Callable
from typing import TypeVar

import zenoh

from robot.bus.endpoint import Endpoint, safe_endpoint
from robot.bus.errors import BusConfigError, BusError, NoHubError
from robot.bus.keys.guard import Guard

__all__ = ["MAX_MESSAGE_BYTES", "on_link", "open_link"]

T = TypeVar("T")

CONNECT_MS = 3000
RETRY = {"period_init_ms": 100, "period_max_ms": 2000, "period_increase_factor": 2}
"""Between tries of a client whose hub is gone; Zenoh makes them by itself, and declares everything anew after."""
MAX_MESSAGE_BYTES = 1 << 24
PROBE_S = 0.5


def open_link(endpoint: str, *, is_hub: bool, is_by_size: bool = False, guard: Guard | None = None) -> zenoh.Session:
    """Open a session on one endpoint, such as tcp/127.0.0.1:7447, without scouting.

    Zenoh's defaults listen on every interface and scout by multicast; and a peer does not forward between two others.
    So one process is the hub, which listens, and all others are its clients.

    Args:
        endpoint: where the hub listens.
        is_hub: this process is the hub.
        is_by_size: every large message goes through shared memory, as it does by Zenoh's defaults.
        guard: certificates, and at the hub who may do what; without one the endpoint is on loopback.

    Raises:
        BusConfigError: it is no endpoint, or others could reach it.
        BusError: the endpoint is taken, or nobody there lets us in within 3 s.
    """
    parts = safe_endpoint(endpoint, has_keys=guard is not None)
    here, nowhere = [endpoint], []
    settings: dict[str, object] = {
        "mode": "router" if is_hub else "client",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # opening a hub waits for it, half a second, though it looks for nobody
        "listen/endpoints": here if is_hub else nowhere,
        "connect/endpoints": nowhere if is_hub else here,
        "connect/timeout_ms": CONNECT_MS,
        "connect/exit_on_failure": True,
        "connect/retry": RETRY,
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        # Topics that are for shared memory allocate there (robot.bus.ports); none goes there by its mere size.
        "transport/shared_memory/transport_optimization/enabled": is_by_size,
    }
    if guard is not None:
        settings |= guard.settings
    config = zenoh.Config()
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
    except zenoh.ZError as error:
        raise BusConfigError(f"bus: expected an endpoint such as tcp/127.0.0.1:7447, got {endpoint!r}") from error
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise (BusError(_why_no_hub(parts, error)) if is_hub else _no_link(parts)) from error


def on_link(function: Callable[[T], None]) -> "zenoh.handlers.Callback[T]":
    """Have a function called on the thread of the link that something came over. It must not wait for the bus.

    Zenoh's default is a Python thread for each function, which the interpreter waits for at its end: a process whose
    session was left open then never ended.
    """
    return zenoh.handlers.Callback(function, indirect=False)


def _why_no_hub(endpoint: Endpoint, error: zenoh.ZError) -> str:
    if _knock(endpoint) == 0:
        return (
            f"bus: expected {endpoint.text} to be free, somebody listens there: end that process or take another port"
        )
    return (
        f"bus: expected to listen at {endpoint.text}, got: {error}; is the address this machine's, the port above 1023?"
    )


def _no_link(endpoint: Endpoint) -> BusError:
    """Return why nobody let us in, as far as a bare connection can tell. Zenoh itself only says that time is over."""
    came = _knock(endpoint)
    if came == 0:
        return BusError(
            f"bus: expected the hub at {endpoint.text} to let us in; somebody listens there and did not, within "
            f"{CONNECT_MS / 1e3:g} s: another program, another version, a hub that hangs, or one that refuses us "
            "(these cannot be told apart from here); see what listens with `ss -ltnp`"
            + (", and `autotelic keys list` where the hub is" if endpoint.is_tls else "")
        )
    if came in (errno.ECONNREFUSED, errno.ENOENT):
        return NoHubError(
            f"bus: expected a hub at {endpoint.text}, nobody listens there: start the process that is the hub first "
            "(`autotelic up RIG` starts all of a rig's; `autotelic controller --bus ...` is one), or mend the "
            "endpoint in the rig's file"
        )
    told = errno.errorcode.get(came, "no answer")
    return BusError(f"bus: expected a hub at {endpoint.text}, it cannot be reached: {told}")


def _knock(endpoint: Endpoint) -> int:
    """Return the error's number of a bare connection, 0 where it was taken, -1 where none came in time."""
    family = socket.AF_UNIX if endpoint.path else socket.AF_INET6 if ":" in endpoint.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.settimeout(PROBE_S)
        try:
            probe.connect(endpoint.path or (endpoint.host, endpoint.port))
        except OSError as error:
            return error.errno or -1
    return 0
