"""A folder with an authority and what it issued. Private keys are readable by their owner alone. The edge.

KEYS/authority/authority.pem, key.pem     where certificates are made
KEYS/authority/ledger.json                there, and where the hub runs
KEYS/authority.pem                        what everybody trusts
KEYS/<source>/certificate.pem, key.pem    what one process shows
"""

import os
import re
import secrets
from datetime import datetime
from pathlib import Path

import msgspec

from robot.bus.errors import BusConfigError
from robot.bus.keys.certificates import Pair, expiry_of, make_authority, make_certificate
from robot.bus.keys.ledger import Entry, Ledger
from robot.bus.topic import NAME, Role

__all__ = ["AUTHORITY", "CERTIFICATE", "KEY", "LEDGER", "Keyring"]

AUTHORITY, CERTIFICATE, KEY, LEDGER = "authority.pem", "certificate.pem", "key.pem", "ledger.json"
AUTHORITY_DAYS = 3650
_HOST = re.compile(r"[A-Za-z0-9._:-]{1,253}")


class Keyring:
    """The folder that `autotelic keys` works on.

    Args:
        folder: Where.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._own = folder / "authority"

    def init(self, *, now: datetime) -> Ledger:
        """Make an authority.

        Raises:
            BusConfigError: there is one: a new one would shut out everything that was issued.
        """
        if self._own.exists():
            raise BusConfigError(
                f"keys: {self.folder} has an authority already: a new one would refuse all that it issued. "
                "Take another folder, or move this one away"
            )
        name = f"autotelic authority {secrets.token_hex(4)}"
        pair = make_authority(name, now=now, days=AUTHORITY_DAYS)
        ledger = Ledger(authority=name)
        self._own.mkdir(parents=True, mode=0o700)
        _write(self._own / KEY, pair.key, is_private=True)
        _write(self._own / AUTHORITY, pair.certificate)
        _write(self.folder / AUTHORITY, pair.certificate)
        self._keep(ledger)
        return ledger

    def issue(self, role: Role, *, source: str, hosts: tuple[str, ...], days: int, now: datetime) -> Entry:
        """Make a certificate for one process; it lies in a folder named after the role, or after its source.

        Raises:
            BusConfigError: no authority, a source or host that is no name, or one such is in force.
        """
        ledger, source = self.ledger(), source or str(role)
        if not re.fullmatch(NAME, source):
            raise BusConfigError(f"keys: expected a source like {role}_2 ({NAME}), got {source!r}")
        for host in hosts:
            if not _HOST.fullmatch(host):
                raise BusConfigError(f"keys: expected an address or a name to listen at, got {host!r}")
        has = next((e for e in ledger.in_force(now) if e.source == source), None)
        if has is not None:
            raise BusConfigError(
                f"keys: {source} has {has.name} until {has.expires:%Y-%m-%d}: revoke that first, or name another source"
            )
        name = f"{role}.{source}.{secrets.token_hex(4)}"
        pair = make_certificate(self._authority(), name, hosts=hosts, now=now, days=days)
        entry = Entry(
            name=name, role=role, source=source, issued=now, expires=expiry_of(pair.certificate), hosts=hosts
        )  # fmt: skip
        shown = self.folder / source
        shown.mkdir(mode=0o700, exist_ok=True)
        _write(shown / KEY, pair.key, is_private=True)
        _write(shown / CERTIFICATE, pair.certificate)
        self._keep(ledger.with_new(entry))  # last: what is in no ledger opens nothing
        return entry

    def revoke(self, name: str, *, now: datetime) -> Ledger:
        """Take a certificate back: a hub that starts from here on lets it do nothing.

        Raises:
            BusConfigError: no authority, or no such certificate.
        """
        ledger = self.ledger().without(name, now=now)
        self._keep(ledger)
        return ledger

    def ledger(self) -> Ledger:
        """Return what was issued.

        Raises:
            BusConfigError: there is no authority here, or its ledger cannot be read.
        """
        path = self._own / LEDGER
        try:
            return msgspec.json.decode(path.read_bytes(), type=Ledger)
        except FileNotFoundError as error:
            raise BusConfigError(
                f"keys: expected an authority in {self.folder}, there is none: `autotelic keys init` makes one; "
                "the hub's machine needs its ledger too"
            ) from error
        except msgspec.DecodeError as error:
            raise BusConfigError(f"keys: {path}: expected a ledger, got: {error}; restore it from a copy") from error

    def _authority(self) -> Pair:
        try:
            return Pair(
                certificate=(self._own / AUTHORITY).read_bytes(), key=(self._own / KEY).read_bytes()
            )  # fmt: skip
        except OSError as error:
            raise BusConfigError(
                f"keys: expected the authority's key in {self._own}: {error.strerror}; make certificates where it is"
            ) from error

    def _keep(self, ledger: Ledger) -> None:
        _write(self._own / LEDGER, msgspec.json.format(msgspec.json.encode(ledger)) + b"\n")


def _write(path: Path, content: bytes, *, is_private: bool = False) -> None:
    """Write a file whole or not at all."""
    beside = path.with_name(f".{path.name}.new")
    beside.unlink(missing_ok=True)
    with os.fdopen(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if is_private else 0o644), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    beside.replace(path)
