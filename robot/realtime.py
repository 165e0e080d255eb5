"""Real-time scheduling for the thread that must keep a tick of 2 ms, where the kernel grants it. Linux only.

Without it a tick waits whenever others want the CPU, for as long as the kernel shares it out. And a thread that is
moved to another CPU finds nothing in its caches of what it worked with.
"""

import gc
import os
from contextlib import suppress
from pathlib import Path
from threading import get_native_id

__all__ = ["CpuPin", "collect_rarely", "take_priority"]

RARELY = 50_000
"""Objects more than there were, before the collector looks for unreachable ones: ticks leave none, and a look takes its
time from one of them."""


def take_priority(priority: int) -> str | None:
    """Run this thread, and whatever it starts from now on, before everything ordinary (SCHED_FIFO).

    Args:
        priority: 1 to 99, higher before lower; 0 leaves everything as it is.

    Returns:
        None, or why the kernel did not grant it.
    """
    if not priority:
        return None
    asked = f"expected real-time priority {priority}"
    if len(os.sched_getaffinity(0)) == 1:
        # ur_rtde's waitPeriod spins to its end: on one processor the client's own threads would never run beside it.
        return f"{asked}, came: one processor only, which the client's own threads need too"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return (
            f"{asked}, came: {error}; ticks will be late while the machine is busy. Grant it (`rtprio` in "
            "/etc/security/limits.conf, `ulimit -r`), or set the rig's realtime_priority to 0"
        )
    return None


class CpuPin:
    """Pins the thread that ticks to the last CPU, and keeps the process's other threads off it.

    Made and called by that thread. Threads that it starts while pinned would have to share its CPU, so that it is
    unpinned before clients are made.

    Args:
        priority: as `take_priority` takes it; with 0, or where that is not granted, nothing is pinned either.

    Attributes:
        why_not: Why the priority was not granted; None where it was, or none was asked for.
        cpus: The CPU; nothing where there is none.
    """

    def __init__(self, priority: int) -> None:
        self.why_not = take_priority(priority)
        self._everywhere = os.sched_getaffinity(0)
        self.cpus = {max(self._everywhere)} if priority and self.why_not is None else set[int]()

    def pin(self) -> None:
        """Stay on the CPU from now on, and send the other threads of this process elsewhere."""
        if not self.cpus:
            return
        for entry in Path("/proc/self/task").iterdir():
            with suppress(OSError):  # a thread that has just ended
                os.sched_setaffinity(int(entry.name), self._everywhere - self.cpus)
        os.sched_setaffinity(get_native_id(), self.cpus)

    def unpin(self) -> None:
        """Run wherever there is room, as threads do that are started from now on."""
        if self.cpus:
            os.sched_setaffinity(0, self._everywhere)

    def release(self) -> None:
        """Unpin, and give the priority up."""
        if self.cpus:
            self.unpin()
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def collect_rarely() -> None:
    """Keep what is there by now for good, and have the collector look at what comes as rarely as can be."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(RARELY)
