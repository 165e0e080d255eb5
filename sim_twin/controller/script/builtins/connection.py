"""One TCP connection that never blocks: what it cannot do now it does not do, and the caller asks again next slice."""

import errno
import re
import socket

__all__ = ["Connection"]

_CONNECTING = (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EALREADY, errno.EINTR)
_N_RECEIVED_MAX = 1 << 16  # bytes, as many as a string may have; what comes then waits with the sender


class Connection:
    """A client's socket and what it has received but not yet handed out. Making one begins to connect.

    Raises:
        OSError: the process has no socket left.
    """

    def __init__(self, address: str, port: int) -> None:
        self._received = bytearray()
        self._is_connected = False
        self._address = "127.0.0.1" if address == "localhost" else address, port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self.is_lost = not self._is_numeric()
        self.is_open()

    def is_open(self) -> bool:
        """Return whether the connection stands; until then each call pushes it on."""
        if not self._is_connected and not self.is_lost:
            try:
                code = self._socket.connect_ex(self._address)
            except (OverflowError, OSError):
                code = errno.EINVAL
            self._is_connected = code in (0, errno.EISCONN)
            self.is_lost = not self._is_connected and code not in _CONNECTING
        return self._is_connected and not self.is_lost

    def send(self, message: bytes) -> bool:
        """Send all of a message or give the connection up: half of one would garble all that follows."""
        if not self.is_open():
            return False
        try:
            is_sent = self._socket.send(message) == len(message)
        except OSError:
            is_sent = False
        self.is_lost = not is_sent
        return is_sent

    def take(self, n_bytes: int) -> bytes | None:
        """Return the next n bytes, or None while there are fewer."""
        self._receive()
        if len(self._received) < n_bytes:
            return None
        taken = bytes(self._received[:n_bytes])
        del self._received[:n_bytes]
        return taken

    def take_through(self, end: bytes) -> bytes | None:
        """Return everything up to and with an ending, or None while it is not there."""
        self._receive()
        at = self._received.find(end)
        return self.take(at + len(end)) if at >= 0 else None

    def take_between(self, begin: bytes, end: bytes) -> bytes | None:
        """Return what stands between two marks and drop it with them and what is before; None while they are not there.

        Without an end it is all that follows.
        """
        self._receive()
        first = self._received.find(begin)
        last = self._received.find(end, first + len(begin)) if first >= 0 else -1
        if not end:
            last = len(self._received)
        if first < 0 or last < 0 or (not end and last == first + len(begin)):
            return None
        taken = bytes(self._received[first + len(begin) : last])
        del self._received[: last + len(end)]
        return taken

    def take_match(self, pattern: re.Pattern[bytes]) -> bytes | None:
        """Return the first match and drop what stands before it, or None while nothing matches."""
        self._receive()
        found = pattern.search(self._received)
        if found is None:
            return None
        taken = found.group()
        del self._received[: found.end()]
        return taken

    def take_any(self, n_bytes_max: int) -> bytes | None:
        """Return what there is, up to so many bytes, or None while there is nothing."""
        self._receive()
        return self.take(min(len(self._received), n_bytes_max)) or None

    def close(self) -> None:
        """Close."""
        self.is_lost = True
        self._socket.close()

    def _receive(self) -> None:
        while (n_free := _N_RECEIVED_MAX - len(self._received)) > 0 and self.is_open():
            try:
                chunk = self._socket.recv(n_free)
            except BlockingIOError:
                return
            except OSError:
                chunk = b""
            self._received += chunk
            self.is_lost = not chunk

    def _is_numeric(self) -> bool:
        """Return whether the address can be used as it stands: to look a name up would block."""
        try:
            socket.inet_aton(self._address[0])
        except OSError:
            return False
        return True
