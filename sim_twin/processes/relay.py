"""A wire between two processes that somebody can cut: bytes go through as they come, until they do not."""

import socket
from contextlib import suppress
from threading import Lock, Thread
from types import TracebackType
from typing import Self

__all__ = ["Relay"]

CHUNK = 65_536


class Relay:
    """Listens at one address and port, and passes what comes on to another, and back.

    Args:
        here: where it listens.
        there: whom it passes on to.
    """

    def __init__(self, here: tuple[str, int], there: tuple[str, int]) -> None:
        self._here, self._there = here, there
        self._server: socket.socket | None = None
        self._ends: list[socket.socket] = []
        self._lock, self._is_cut = Lock(), False

    def __enter__(self) -> Self:
        self._server = socket.create_server(self._here)
        Thread(target=self._accept, args=(self._server,), daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._server is not None:
            _close(self._server)
        self.cut()

    def cut(self) -> None:
        """Cut every connection, and take no other."""
        with self._lock:
            self._is_cut = True
            ends, self._ends = self._ends, []
        for end in ends:
            _close(end)

    def mend(self) -> None:
        """Take connections again."""
        with self._lock:
            self._is_cut = False

    def _accept(self, server: socket.socket) -> None:
        with suppress(OSError):  # closed: it is over
            while True:
                near, _ = server.accept()
                self._join(near)

    def _join(self, near: socket.socket) -> None:
        try:
            far = socket.create_connection(self._there)
        except OSError:
            _close(near)
            return
        with self._lock:
            is_cut = self._is_cut
            if not is_cut:
                self._ends += [near, far]
        if is_cut:
            _close(near)
            _close(far)
            return
        for end in (near, far):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        Thread(target=_pump, args=(near, far), daemon=True).start()
        Thread(target=_pump, args=(far, near), daemon=True).start()


def _pump(source: socket.socket, sink: socket.socket) -> None:
    with suppress(OSError):
        while chunk := source.recv(CHUNK):
            sink.sendall(chunk)
    _close(source)
    _close(sink)


def _close(end: socket.socket) -> None:
    with suppress(OSError):
        end.shutdown(socket.SHUT_RDWR)
    end.close()
