"""Ends a program whose process was lost while it took command: no watchdog was armed yet that would end it.

From the upload to the client's word that arms the watchdog it is some 150 ms. Whoever is lost between leaves a program
that waits for good, and that every later connection refuses as somebody's. The edge: the controller's dashboard port.
"""

import socket
from contextlib import suppress
from threading import Thread
from time import monotonic, sleep

from robot.hal.pendant import PORT

__all__ = ["PATIENCE_S", "Leftover"]

PATIENCE_S = 2.0
"""So long after the loss a program on the arm is still the one that was lost; later it may be anybody's."""
SETTLED_S = 0.5
"""What was on its way at the loss has begun by then."""
LOOK_S, TIMEOUT_S = 0.05, 0.2
N_BYTES = 4096


class Leftover:
    """Ends what runs on the arm at an address, from a thread, from `begin` until it rests or patience ends.

    Args:
        address: host of the controller.
        patience_s: how long to try.
    """

    def __init__(self, address: str, *, patience_s: float = PATIENCE_S) -> None:
        self._at, self._patience_s = (address, PORT), patience_s
        self._thread: Thread | None = None
        self._is_ended = True

    def begin(self) -> None:
        """Begin: the process was lost just now."""
        self.wait()
        self._is_ended = False
        self._thread = Thread(target=self._run, name="leftover", daemon=True)
        self._thread.start()

    def wait(self) -> bool:
        """Wait until it is over. Returns whether no program was left, as far as the controller said so."""
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        return self._is_ended

    def _run(self) -> None:
        begun_s = monotonic()
        while (gone_s := monotonic() - begun_s) < self._patience_s:
            with suppress(OSError):
                self._is_ended = self._look()
                if self._is_ended and gone_s > SETTLED_S:
                    return
            sleep(LOOK_S)

    def _look(self) -> bool:
        """End a program that runs. Returns whether none does.

        Raises:
            OSError: nobody answers there.
        """
        with socket.create_connection(self._at, timeout=TIMEOUT_S) as link, link.makefile("rb") as answers:
            answers.readline(N_BYTES)  # it greets first
            link.sendall(b"programState\n")
            if answers.readline(N_BYTES).startswith(b"STOPPED"):
                return True
            link.sendall(b"stop\n")
            answers.readline(N_BYTES)
        return False
