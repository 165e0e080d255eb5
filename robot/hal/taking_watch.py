"""Sees from outside that a controller hung up or fell silent while a process takes command of its arm.

The client that takes command lets no thread of its own process run while it is made, 0.2 s, or goes, 0.5 s. So whoever
waits for that process listens to the controller himself, by a connection of his own that writes nothing, and ends the
process where it cannot know.

Protocol: UR, "Real-Time Data Exchange (RTDE) guide". The edge: a socket and a thread.
"""

import os
import socket
import struct
from collections.abc import Callable
from math import inf
from select import POLLIN, poll
from threading import Event, Thread
from types import TracebackType
from typing import Self

from robot.errors import WireError
from robot.hal.rtde_probe import RTDE_PORT

__all__ = ["TakingWatch"]

RATE_HZ = 125.0
LOOK_S, N_SILENT = 0.01, 6
"""A controller that says nothing for so many looks has fallen silent. Looks are counted, not time: where this process
stood still itself, what came meanwhile is read first."""
GRACE_S = 0.02
"""So long a cut is left to the process, which knows more of it, and can stop the fingers."""
TIMEOUT_S = 2.0
N_BYTES = 4096
_HEADER = struct.Struct(">HB")
_PACKAGE = struct.Struct(">Bd")
_QUESTIONS = (("V", b"\x00\x02"), ("O", struct.pack(">d", RATE_HZ) + b"timestamp"), ("S", b""))


class TakingWatch:
    """Listens to the controller at an address from `with` to its end, and says once that it was lost.

    Args:
        address: host or IP address of the controller.
        when_lost: called from a thread.
        port: its RTDE port.

    Attributes:
        why: What was seen; None where nothing was.
        alarm: A descriptor that can be read from then on, for whoever waits for something else too.
    """

    def __init__(self, address: str, *, when_lost: Callable[[], object], port: int = RTDE_PORT) -> None:
        self._at, self._when_lost = (address, port), when_lost
        self._is_over = Event()
        self._thread = Thread(target=self._run, name="taking watch", daemon=True)
        self._unread, self._time_s = b"", -inf
        self.why: str | None = None

    def __enter__(self) -> Self:
        """Begin to listen.

        Raises:
            WireError: nobody answers there.
        """
        try:
            self._link = socket.create_connection(self._at, timeout=TIMEOUT_S)
            try:
                self._ask()
            except OSError:
                self._link.close()
                raise
        except OSError as error:
            host, port = self._at
            raise WireError(f"RTDE: expected an answer at {host}:{port}, got {error or 'none in time'}") from error
        self.alarm = os.eventfd(0, os.EFD_NONBLOCK)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._is_over.set()
        self._thread.join()
        self._link.close()
        os.close(self.alarm)

    def _ask(self) -> None:
        """Ask for the controller's own time, again and again."""
        for kind, payload in _QUESTIONS:
            self._link.sendall(_HEADER.pack(_HEADER.size + len(payload), ord(kind)) + payload)
            if not self._link.recv(N_BYTES):
                raise ConnectionResetError("the other side closed the connection")

    def _run(self) -> None:
        looks, n_silent = poll(), 0
        looks.register(self._link, POLLIN)
        while not self._is_over.is_set():
            is_told = bool(looks.poll(1e3 * LOOK_S))
            if is_told and self._is_cut():
                self._tell("it hung up", grace_s=GRACE_S)
                return
            n_silent = 0 if is_told and self._goes_on() else n_silent + 1
            if n_silent >= N_SILENT:
                what = "its time has stood still" if is_told else "it has said nothing"
                self._tell(f"{what} for {1e3 * LOOK_S * N_SILENT:.0f} ms", grace_s=0.0)
                return

    def _is_cut(self) -> bool:
        """Take what came. Returns whether that is the end of it."""
        try:
            came = self._link.recv(N_BYTES)
        except OSError:
            return True
        self._unread += came
        return not came

    def _goes_on(self) -> bool:
        """Read the whole packages that came. Returns whether one of them tells a later time than any before."""
        before_s = self._time_s
        while len(self._unread) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._unread)
            if len(self._unread) < max(size, _HEADER.size):
                break
            if kind == ord("U") and size == _HEADER.size + _PACKAGE.size:
                _, self._time_s = _PACKAGE.unpack_from(self._unread, _HEADER.size)
            self._unread = self._unread[max(size, _HEADER.size) :]
        return self._time_s > before_s

    def _tell(self, what: str, *, grace_s: float) -> None:
        if not self._is_over.wait(grace_s):
            self.why = f"the controller at {self._at[0]} was lost while command of its arm was taken: {what}"
            self._when_lost()
            os.eventfd_write(self.alarm, 1)
