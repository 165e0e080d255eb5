"""Ends a servo process that has stopped ticking while it should: a call that hangs inside the client library."""

import os
import signal
from collections.abc import Sequence
from contextlib import suppress
from threading import Event, Thread

__all__ = ["HUNG_S", "ServoWatch"]

LOOK_S = 0.005
N_LOOKS = 12
HUNG_S = LOOK_S * N_LOOKS
"""Without a tick for so long a process counts as hung. The controller's own watchdog stops the arm after 100 ms."""


class ServoWatch:
    """Looks at a process's pulse from a thread, and kills the process when it stands still.

    Looks are counted, not time: a machine that stood still as a whole ends nothing.

    Args:
        pid: the process, a child of this one that nobody has waited for.
        pulse: its shared memory: ticks so far while it ticks, otherwise 0.

    Attributes:
        was_hung: It was killed from here.
    """

    def __init__(self, pid: int, pulse: Sequence[int]) -> None:
        self._pulse = pulse
        self._process = os.pidfd_open(pid)
        self._is_over = Event()
        self.was_hung = False
        self._thread = Thread(target=self._run, name="servo watch", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the watch; the process goes on. Idempotent."""
        if not self._is_over.is_set():
            self._is_over.set()
            self._thread.join()
            os.close(self._process)

    def _run(self) -> None:
        last, n_same = 0, 0
        while not self._is_over.wait(LOOK_S):
            now = self._pulse[0]
            n_same = n_same + 1 if now and now == last else 0
            last = now
            if n_same >= N_LOOKS:
                self.was_hung = True
                with suppress(ProcessLookupError):
                    signal.pidfd_send_signal(self._process, signal.SIGKILL)
                return
