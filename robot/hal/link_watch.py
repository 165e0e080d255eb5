"""Sees at once that the other side hung up on connections which somebody else's library holds. Linux only.

ur_rtde's client notices a cut in its own time, and then reconnects, sends its script anew and repeats the last command,
all inside the call that found out. So the operating system is asked first.
"""

import os
import select
import socket
from contextlib import suppress
from pathlib import Path

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

    def look(self) -> int:
        """Take in the connections that are open now, and return how many are watched.

        Raises:
            OSError: the host has no address.
        """
        address = socket.gethostbyname(self._host)
        for entry in Path("/proc/self/fd").iterdir():
            with suppress(OSError):  # a descriptor of something else, or closed meanwhile
                self._take(int(entry.name), address)
        return len(self._duplicates)

    def is_cut(self) -> bool:
        """Return whether any of them was hung up by the other side, or broke. Takes some microseconds."""
        events = self._poll.poll(0)
        return bool(events) and any(bits & _CUT for _, bits in events)

    def forget(self) -> None:
        """Watch nothing any more."""
        for duplicate in self._duplicates.values():
            self._poll.unregister(duplicate)
            os.close(duplicate)
        self._duplicates.clear()

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
