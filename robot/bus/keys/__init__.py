"""Certificates of a rig's processes, and what each may do on the bus."""

from robot.bus.keys.access import access_rules
from robot.bus.keys.credentials import Credentials, read_credentials
from robot.bus.keys.keyring import Keyring
from robot.bus.keys.ledger import Entry, Ledger

__all__ = ["Credentials", "Entry", "Keyring", "Ledger", "access_rules", "read_credentials"]
