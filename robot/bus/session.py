"""Zenoh sessions that listen and connect where they are told, and nowhere else."""

import json

import zenoh

from robot.errors import WireError

__all__ = ["BusError", "open_session"]

CONNECT_MS = 3000


class BusError(WireError):
    """The bus cannot be opened or does not answer."""


def open_session(endpoint: str, *, is_hub: bool) -> zenoh.Session:
    """Open a session on one endpoint, such as tcp/127.0.0.1:7447, without scouting.

    Zenoh's defaults listen on every interface and scout by multicast; and a peer does not forward between two others.
    So one process is the hub, which listens, and all others are its clients.

    Args:
        endpoint: where the hub listens.
        is_hub: this process is the hub.

    Raises:
        BusError: the endpoint is taken, or nobody listens there.
    """
    config = zenoh.Config()
    config.insert_json5("mode", '"router"' if is_hub else '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    config.insert_json5("connect/timeout_ms", str(CONNECT_MS))
    config.insert_json5("connect/exit_on_failure", "true")
    here = json.dumps([endpoint])
    try:
        config.insert_json5("listen/endpoints", here if is_hub else "[]")
        config.insert_json5("connect/endpoints", "[]" if is_hub else here)
    except zenoh.ZError as error:
        raise BusError(f"bus: expected an endpoint such as tcp/127.0.0.1:7447, got {endpoint!r}") from error
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        what = "that it is free" if is_hub else "a hub that listens there and lets us in"
        raise BusError(f"bus: expected {what} at {endpoint}, got: {error}") from error
