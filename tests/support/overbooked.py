"""How long this machine had too few processors, by the kernel's own count."""

import os
import time
from contextlib import suppress
from pathlib import Path

__all__ = ["OVERBOOKED_SHARE", "Overbooked", "waited_s"]

OVERBOOKED_SHARE = 0.1
"""Where somebody waited for a processor for more than this share of the time, processes that begin and three that
tick at 500 Hz do not explain it."""


def waited_s():
    """Return how long somebody on this machine has been ready to run and did not, or its host ran something else."""
    found_s = 0.0
    with suppress(OSError, ValueError, IndexError):
        steal = Path("/proc/stat").read_text().split("\n", 1)[0].split()[8]
        found_s += int(steal) / os.sysconf("SC_CLK_TCK")
    with suppress(OSError, ValueError, IndexError):
        some = Path("/proc/pressure/cpu").read_text().split("\n", 1)[0]
        found_s += int(some.rsplit("total=", 1)[1]) * 1e-6
    return found_s


class Overbooked:
    """Measures from its making on."""

    def __init__(self):
        self._begun_s, self._before_s = time.monotonic(), waited_s()

    def share(self):
        """Return the share of the time in which somebody waited for a processor."""
        return (waited_s() - self._before_s) / max(time.monotonic() - self._begun_s, 1e-3)
