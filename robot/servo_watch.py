"""Ends a servo process that has stopped ticking while it should: a call that hangs inside the client library."""

import os
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Lock, Thread

__all__ = ["HUNG_S", "Patience", "ServoWatch"]

LOOK_S = 0.005
N_ASLEEP, N_LOOKS = 4, 12
HUNG_S = LOOK_S * N_LOOKS
"""Without a tick for so long a process counts as hung, and for 20 ms where it did not even want to run: it waits for
something inside the client, which may be reconnecting. The controller's own watchdog stops the arm after 100 ms."""
RUNNABLE = "R"


class Patience:
    """Counts looks at a pulse that stands still. One that is kept from running by others is given longer."""

    def __init__(self) -> None:
        self._last = self._n_same = self._n_asleep = 0

    def is_over(self, pulse: int, *, is_asleep: Callable[[], bool]) -> bool:
        """Return whether the process hangs.

        Args:
            pulse: its ticks so far while it ticks, otherwise 0.
            is_asleep: whether it waits for something else than a processor; asked only where the pulse stands still.
        """
        if not pulse or pulse != self._last:
            self._last, self._n_same, self._n_asleep = pulse, 0, 0
            return False
        self._n_same += 1
        self._n_asleep += is_asleep()
        return self._n_asleep >= N_ASLEEP or self._n_same >= N_LOOKS


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
        self._stat = Path(f"/proc/{pid}/stat")
        self._process = os.pidfd_open(pid)
        self._is_over, self._lock = Event(), Lock()
        self.was_hung = False
        self._thread = Thread(target=self._run, name="servo watch", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the watch; the process goes on. Idempotent."""
        with self._lock:
            is_first = not self._is_over.is_set()
            self._is_over.set()
        if is_first:
            self._thread.join()
            os.close(self._process)

    def kill(self) -> None:
        """Kill the process, from any thread; one whose watch has ended is left alone."""
        with self._lock, suppress(ProcessLookupError):
            if not self._is_over.is_set():
                signal.pidfd_send_signal(self._process, signal.SIGKILL)

    def _run(self) -> None:
        patience = Patience()
        while not self._is_over.wait(LOOK_S):
            if patience.is_over(self._pulse[0], is_asleep=self._is_asleep):
                self.was_hung = True
                self.kill()
                return

    def _is_asleep(self) -> bool:
        try:
            return self._stat.read_text().rpartition(")")[2].split()[0] != RUNNABLE
        except (OSError, IndexError):
            return False  # it ended
