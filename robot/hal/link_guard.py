"""Ends what nobody can be asked about any more: a client that has lost its link while no tick looks after it.

ur_rtde's control client reconnects and sends its program anew from a thread of its own, whatever this process does
meanwhile: waits for the arm to rest, for somebody's next word, or inside another call of the client.
"""

from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from time import monotonic

from robot.hal.link_watch import LinkWatch

__all__ = ["LinkGuard"]

LOOK_S, N_LOOKS = 0.25, 4
"""A controller whose time stands still for that many looks is lost: the client's patience ends after 2.5 s."""
GRACE_S = 0.01
"""So long a loss is left to whoever ticks, who can tell why: a reconnection takes 40 ms at least."""


class LinkGuard:
    """Watches links from a thread, from `begin` to `end`, and says once that they are lost.

    Args:
        links: what is watched.
        timestamp_s: the controller's own time as last heard.
        when_lost: called from the thread; a process that holds an arm ends here.
    """

    def __init__(self, links: LinkWatch, *, timestamp_s: Callable[[], float], when_lost: Callable[[], object]) -> None:
        self._links, self._timestamp_s, self._when_lost = links, timestamp_s, when_lost
        self._is_over = Event()
        self._thread: Thread | None = None

    def begin(self) -> None:
        """Watch from now on."""
        self._is_over.clear()
        self._thread = Thread(target=self._run, name="link guard", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Watch no more; the links are forgotten. Idempotent."""
        self._is_over.set()
        self._links.forget()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        self._links.close()

    def _run(self) -> None:
        last, n_same = -1.0, 0
        while not self._is_over.is_set():
            begun_s, now = monotonic(), last
            is_cut = self._links.wait_cut(LOOK_S)
            if not is_cut and monotonic() - begun_s < LOOK_S:
                continue
            with suppress(RuntimeError):  # the client throws it where it has no state
                now = self._timestamp_s()
            n_same, last = (n_same + 1 if now == last else 0), now
            if is_cut or n_same >= N_LOOKS:
                if not self._is_over.wait(GRACE_S):
                    self._when_lost()
                return
