"""Ends a program of ours whose process was lost while it took command: no watchdog was armed yet that would end it.

From the upload to the client's word that arms the watchdog it is some 150 ms. Whoever is lost between leaves a program
that waits for good, and that every later connection refuses as somebody's. What runs under another name is somebody's,
and is left alone. The edge: the controller's dashboard port, and its primary interface.
"""

import socket
from contextlib import suppress
from threading import Thread
from time import monotonic, sleep

from robot.errors import WireError
from robot.hal.pendant import PORT
from robot.hal.primary_link import PrimaryLink
from robot.hal.programs_told import OURS, ProgramsTold
from robot.hal.ur_primary import parse_key

__all__ = ["PATIENCE_S", "Leftover"]

PATIENCE_S = 2.0
"""So long after the loss a program on the arm is still the one that was lost; later it may be anybody's."""
SETTLED_S = 0.5
"""What was on its way at the loss has begun by then."""
LOOK_S, TIMEOUT_S = 0.05, 0.2
N_BYTES = 4096
UNNAMED = ("", "<unnamed>")
LOADED = ".urp"
"""A dashboard that does not say what a script is called says nothing, or what file is loaded at the pendant."""


class Leftover:
    """Ends what of ours runs on the arm at an address, from a thread, from `begin` until it rests or patience ends.

    Args:
        address: host of the controller.
        patience_s: how long to try.
    """

    def __init__(self, address: str, *, patience_s: float = PATIENCE_S) -> None:
        self._at, self._patience_s = (address, PORT), patience_s
        self._ear, self._told = PrimaryLink(address), ProgramsTold()
        self._thread: Thread | None = None
        self._is_ended = True

    def listen(self) -> None:
        """Hear from now on what is started: before there is a loss. Where nobody answers nothing is heard."""
        self.wait()
        self._told = ProgramsTold()
        with suppress(WireError):
            self._ear.open()

    def foreign(self) -> str | None:
        """Return the name of a program that was heard to start and is not called as ours; None for none."""
        while packages := self._ear.heard():
            for key in map(parse_key, packages):
                if key is not None:
                    self._told.n_due = 1  # how many this process cannot know: by its name alone it is ours
                    self._told.take(key)
        return self._told.foreign

    def begin(self) -> None:
        """Begin: the process was lost just now."""
        self._join()
        self._is_ended = False
        self._thread = Thread(target=self._run, name="leftover", daemon=True)
        self._thread.start()

    def wait(self) -> bool:
        """Wait until it is over, and hear no more. Returns whether none of ours was left, as far as it was told."""
        self._join()
        self._ear.close()
        return self._is_ended

    def _join(self) -> None:
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()

    def _run(self) -> None:
        begun_s = monotonic()
        while (gone_s := monotonic() - begun_s) < self._patience_s:
            with suppress(OSError):
                self._is_ended = self._look()
                if self._is_ended and gone_s > SETTLED_S:
                    return
            sleep(LOOK_S)

    def _look(self) -> bool:
        """End a program of ours that runs. Returns whether none does.

        Raises:
            OSError: nobody answers there.
        """
        with socket.create_connection(self._at, timeout=TIMEOUT_S) as link, link.makefile("rb") as answers:
            answers.readline(N_BYTES)  # it greets first
            link.sendall(b"programState\n")
            state, _, name = answers.readline(N_BYTES).decode("utf-8", "replace").strip().partition(" ")
            if state == "STOPPED" or not self._is_ours(name):
                return True
            link.sendall(b"stop\n")
            answers.readline(N_BYTES)
        return False

    def _is_ours(self, name: str) -> bool:
        """Return whether what runs is ours: by the dashboard's name; where that is no script's, by what was heard."""
        if name not in UNNAMED and not name.endswith(LOADED):
            return name == OURS
        self.foreign()
        return self._told.running == OURS
