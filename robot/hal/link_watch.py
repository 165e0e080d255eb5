"""Sees at once that the other side hung up on connections which somebody else's library holds. Linux only.

ur_rtde's client notices a cut in its own time, and then reconnects, sends its script anew and repeats the last command,
all inside the call that found out. So the operating system is asked first.
"""

import os
import select
import socket
from contextlib import suppress
from pathlib import Path
from threading import Lock

__all__ = ["LinkWatch"]

_CUT = select.POLLRDHUP | select.POLLHUP | select.POLLERR | select.POLLNVAL


class LinkWatch:
    """Watches this process's TCP connections to one port of a host, through duplicates of their descriptors.

    Args:
        host: IP address or name of the other side.
        port: its port.
    """

    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self._duplicates: dict[tuple[str, int], int] = {}
        self._poll = select.poll()
        self._lock, self._n_changes = Lock(), 0
        self._wake = -1

    def look(self) -> int:
        """Take in the connections that are open now, and return how many are watched.

        Raises:
            OSError: the host has no address.
        """
        address = socket.gethostbyname(self._host)
        with self._lock:
            self._n_changes += 1
            for entry in Path("/proc/self/fd").iterdir():
                with suppress(OSError):  # a descriptor of something else, or closed meanwhile
                    self._take(int(entry.name), address)
        self._rouse()
        return len(self._duplicates)

    @property
    def n_watched(self) -> int:
        """How many are watched."""
        return len(self._duplicates)

    def is_cut(self) -> bool:
        """Return whether any of them was hung up by the other side, or broke. Takes some microseconds."""
        events = self._poll.poll(0)
        return bool(events) and any(bits & _CUT for _, bits in events)

    def wait_cut(self, timeout_s: float) -> bool:
        """Wait until one of them is cut, or what is watched changes. For one thread beside the one that asks.

        Returns:
            Whether one is cut.
        """
        poll = select.poll()
        with self._lock:
            if self._wake < 0:
                self._wake = os.eventfd(0, os.EFD_NONBLOCK)
            n_changes = self._n_changes
            for duplicate in self._duplicates.values():
                poll.register(duplicate, select.POLLRDHUP)
            poll.register(self._wake, select.POLLIN)
        events = poll.poll(1e3 * timeout_s)
        with self._lock:
            if n_changes != self._n_changes:
                return False  # a descriptor that was closed since looks cut
            with suppress(BlockingIOError):
                os.eventfd_read(self._wake)
            return any(bits & _CUT for _, bits in events)

    def forget(self) -> None:
        """Watch nothing any more."""
        with self._lock:
            self._n_changes += 1
            for duplicate in self._duplicates.values():
                self._poll.unregister(duplicate)
                os.close(duplicate)
            self._duplicates.clear()
        self._rouse()

    def close(self) -> None:
        """Forget, once nobody waits any more. Idempotent."""
        self.forget()
        wake, self._wake = self._wake, -1
        if wake >= 0:
            os.close(wake)

    def _rouse(self) -> None:
        if self._wake >= 0:
            os.eventfd_write(self._wake, 1)

    def _take(self, descriptor: int, address: str) -> None:
        duplicate = os.dup(descriptor)
        try:
            connection = socket.socket(fileno=duplicate)
        except OSError:
            os.close(duplicate)
            return
        with connection:
            peer, own = connection.getpeername(), connection.getsockname()
            if peer[:2] == (address, self._port) and own not in self._duplicates:
                self._duplicates[own] = connection.detach()
                self._poll.register(duplicate, select.POLLRDHUP)
