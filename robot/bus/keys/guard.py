"""What Zenoh is told so that a link asks for certificates on both ends, and the hub lets each do its own alone."""

from datetime import datetime
from pathlib import Path
from typing import Any

import msgspec

from robot.bus.keys.access import access_rules
from robot.bus.keys.credentials import Credentials, read_credentials
from robot.bus.keys.keyring import Keyring
from robot.bus.topics import QUERIES, TOPICS

__all__ = ["Guard", "guard_of"]


class Guard(msgspec.Struct, frozen=True, kw_only=True):
    """Settings of a link that is guarded."""

    settings: dict[str, Any]


def guard_of(folder: Path, source: str, *, is_hub: bool, now: datetime) -> Guard:
    """Return how the process of that name guards its link.

    Raises:
        BusConfigError: its certificate is missing or over, or the hub has no ledger.
    """
    credentials = read_credentials(folder, source, now=now)
    settings: dict[str, Any] = {"transport/link/tls": _tls(credentials)}
    if is_hub:
        ledger = Keyring(folder).ledger()
        settings["access_control"] = access_rules(ledger, now=now, topics=TOPICS, queries=QUERIES)
    return Guard(settings=settings)


def _tls(credentials: Credentials) -> dict[str, Any]:
    certificate, key = str(credentials.certificate), str(credentials.key)
    return {
        "root_ca_certificate": str(credentials.authority),
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
