"""Real-time scheduling for the thread that must keep a tick of 2 ms, where the kernel grants it. Linux only.

Without it a tick waits whenever others want the processor, for as long as the kernel shares it out: half a millisecond
at a time and more. And a thread that is moved to another processor finds nothing there of what it worked with: its tick
takes twice as long.
"""

import gc
import os
from contextlib import suppress
from pathlib import Path
from threading import get_native_id

__all__ = ["Seat", "collect_rarely", "take_priority"]

RARELY = 50_000
"""Objects more than there were, before the collector looks for unreachable ones: some seconds of ticks. Ticks leave
none, and each of its looks takes a tenth of one."""


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


class Seat:
    """A processor for the thread that ticks: the last one, which the process's other threads then leave alone.

    Made, taken and left by that thread. Threads that it starts while it sits would have to share the seat, so that it
    is left before clients are made.

    Args:
        priority: as `take_priority` takes it; 0 takes no seat either.

    Attributes:
        why_not: Why the priority was not granted; None where it was, or none was asked for.
    """

    def __init__(self, priority: int) -> None:
        self.why_not = take_priority(priority)
        self._everywhere = os.sched_getaffinity(0)
        self._seat = {max(self._everywhere)} if priority and self.why_not is None else set[int]()

    @property
    def processors(self) -> set[int]:
        """The seat; nothing where there is none."""
        return set(self._seat)

    def take(self) -> None:
        """Stay on the seat from now on, and send the other threads of this process elsewhere."""
        if not self._seat:
            return
        own = get_native_id()
        for entry in Path("/proc/self/task").iterdir():
            with suppress(OSError):  # a thread that has just ended
                os.sched_setaffinity(int(entry.name), self._everywhere - self._seat)
        os.sched_setaffinity(own, self._seat)

    def leave(self) -> None:
        """Run wherever there is room, as threads do that are started from now on."""
        if self._seat:
            os.sched_setaffinity(0, self._everywhere)

    def give_up(self) -> None:
        """Leave the seat and the priority."""
        if self._seat:
            self.leave()
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def collect_rarely() -> None:
    """Keep what is there by now for good, and have the collector look at what comes as rarely as can be."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(RARELY)
