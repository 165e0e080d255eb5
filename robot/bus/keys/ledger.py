"""What an authority has issued and taken back. Plain values."""

from datetime import datetime

import msgspec

from robot.bus.errors import BusConfigError
from robot.bus.topic import Role

__all__ = ["Entry", "Ledger"]


class Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One certificate."""

    name: str
    """Its common name, like no other's: the hub tells processes apart by it."""
    role: Role
    source: str
    """Which process of that role."""
    issued: datetime
    expires: datetime
    hosts: tuple[str, ...] = ()
    """Addresses and names that a hub with it may listen at; empty for a client's."""
    revoked: datetime | None = None

    def state_at(self, now: datetime) -> str:
        """Return valid, expired or revoked."""
        if self.revoked is not None:
            return "revoked"
        return "valid" if now < self.expires else "expired"


class Ledger(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All that one authority issued, the newest last."""

    authority: str
    entries: tuple[Entry, ...] = ()

    def with_new(self, entry: Entry) -> "Ledger":
        """Return the ledger with one more."""
        return msgspec.structs.replace(self, entries=(*self.entries, entry))

    def without(self, name: str, *, now: datetime) -> "Ledger":
        """Return the ledger with a certificate taken back.

        Raises:
            BusConfigError: there is none of that name, or it was taken back already.
        """
        found = next((e for e in self.entries if e.name == name), None)
        if found is None or found.revoked is not None:
            known = ", ".join(e.name for e in self.entries if e.revoked is None) or "none"
            wrong = "was revoked already" if found is not None else "was never issued"
            raise BusConfigError(f"keys: {name} {wrong}; what can be revoked: {known}")
        gone = msgspec.structs.replace(found, revoked=now)
        return msgspec.structs.replace(self, entries=tuple(gone if e is found else e for e in self.entries))

    def in_force(self, now: datetime) -> tuple[Entry, ...]:
        """Return what opens the bus now."""
        return tuple(e for e in self.entries if e.state_at(now) == "valid")
