"""Loopback addresses of this run's own: two runs of the suite on one machine do not meet."""

import os
from itertools import count

__all__ = ["own_address"]

FIRST_BLOCK, N_BLOCKS = 32, 96
"""127.0.x.x up to 127.31.x.x are left to people and to addresses that mean something."""
_numbers = count()


def own_address() -> str:
    """Return a loopback address that this process has not used yet and no other test run uses."""
    pid = os.getpid()
    return f"127.{FIRST_BLOCK + next(_numbers) % N_BLOCKS}.{pid >> 7 & 0xFF}.{1 + (pid & 0x7F)}"
