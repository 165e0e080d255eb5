"""What one process shows on the bus, read and looked at before anything is opened."""

from datetime import datetime
from pathlib import Path

import msgspec

from robot.bus.errors import BusConfigError
from robot.bus.keys.certificates import expiry_of
from robot.bus.keys.keyring import AUTHORITY, CERTIFICATE, KEY

__all__ = ["Credentials", "read_credentials"]

OTHERS = 0o077


class Credentials(msgspec.Struct, frozen=True, kw_only=True):
    """Three files."""

    authority: Path
    certificate: Path
    key: Path
    expires: datetime


def read_credentials(folder: Path, source: str, *, now: datetime) -> Credentials:
    """Return what the process of that name shows.

    Args:
        folder: Of the keys, as `autotelic keys` makes it, or a copy of the parts that one machine needs.
        source: The process's name, mostly its role.
        now: Of this machine.

    Raises:
        BusConfigError: a file is missing, is no certificate, can be read by others, or is over.
    """
    authority, own = folder / AUTHORITY, folder / source
    for path in (authority, own / CERTIFICATE, own / KEY):
        if not path.is_file():
            raise BusConfigError(
                f"keys: expected {path}: issue it with `autotelic keys issue ROLE --source {source}` and copy it here"
            )
    if (own / KEY).stat().st_mode & OTHERS:
        raise BusConfigError(f"keys: {own / KEY} can be read by others than its owner: chmod 600 it")
    try:
        expires = expiry_of((own / CERTIFICATE).read_bytes())
    except ValueError as error:
        raise BusConfigError(f"keys: {own / CERTIFICATE}: expected a certificate (PEM), got: {error}") from error
    if now >= expires:
        raise BusConfigError(
            f"keys: the certificate of {source} was over at {expires:%Y-%m-%d %H:%M} UTC: issue a new one"
        )
    return Credentials(authority=authority, certificate=own / CERTIFICATE, key=own / KEY, expires=expires)
