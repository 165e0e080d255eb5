"""Which monotonic clock this process goes by."""

import os
from pathlib import Path
from time import monotonic_ns
from zlib import crc32

__all__ = ["clock_number"]

BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def clock_number() -> int:
    """Return a number that two processes share if they share their monotonic clock: that of the machine's last boot.

    Where the kernel does not tell it, one that nobody shares: no age is judged then.
    """
    try:
        return crc32(BOOT_ID.read_bytes())
    except OSError:
        return crc32(f"{os.getpid()} {monotonic_ns()}".encode())
