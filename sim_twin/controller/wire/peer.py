"""One connection: what it has said, what it is owed, and when it is given up."""

from collections import deque
from socket import socket
from typing import Protocol

import msgspec

__all__ = ["Budget", "Host", "Peer", "Service"]


class Budget(msgspec.Struct, frozen=True, kw_only=True):
    """What one port grants its peers.

    Attributes:
        bytes_a_poll: Read from each peer in one poll.
        accepts_a_poll: New connections in one poll.
        n_peers: Open connections; one more is closed at once.
        stream_bytes: Unsent bytes beyond which a package of a stream is left out.
        reply_bytes: Unsent bytes beyond which a peer that does not read its replies is dropped.
    """

    bytes_a_poll: int = 4096
    accepts_a_poll: int = 4
    n_peers: int = 32
    stream_bytes: int = 16_384
    reply_bytes: int = 262_144


class Service(Protocol):
    """What answers the peers of a port. A service never raises for what a peer sent."""

    def opened(self, peer: "Peer") -> None:
        """Greet a new peer."""
        ...

    def received(self, peer: "Peer", chunk: bytes) -> None:
        """Take the next bytes of a peer, cut anywhere."""
        ...

    def closed(self, peer: "Peer") -> None:
        """Forget a peer; called once for each that was opened."""
        ...


class Host(Protocol):
    """The port that a peer is connected to.

    Attributes:
        service: What answers.
        budget: What each peer is granted.
        delay_ticks: Polls by which everything is late.
        is_frozen: Whether nothing is read or sent.
        tick: Polls so far.
    """

    service: Service
    budget: Budget
    delay_ticks: int
    is_frozen: bool
    tick: int

    def wake(self, peer: "Peer") -> None:
        """Note that a peer has work left for the next poll."""
        ...

    def forget(self, peer: "Peer", connection: socket) -> None:
        """Strike a peer that closes off the lists."""
        ...


class Peer:
    """One connection.

    Attributes:
        address: The peer's IP address and port.
        n_skipped: Packages of streams that were left out because the peer did not read.
    """

    def __init__(self, connection: socket, address: tuple[str, int], host: "Host") -> None:
        self.address = address
        self.n_skipped = 0
        self._socket = connection
        self._host = host
        self._unsent = bytearray()
        self._is_closing = False
        self._is_open = True
        self._is_gathering = False
        self._inbox: deque[tuple[int, bytes]] = deque()
        self._outbox: deque[tuple[int, bytes]] = deque()
        self._n_delayed = 0

    @property
    def is_open(self) -> bool:
        """Whether the connection still stands."""
        return self._is_open

    @property
    def n_unsent(self) -> int:
        """Bytes that wait for the peer to read."""
        return len(self._unsent) + self._n_delayed

    def reply(self, message: bytes) -> None:
        """Send a message that must arrive; a peer that cannot take it is dropped."""
        if not self._is_open or self._is_closing:
            return
        if self.n_unsent and self.n_unsent + len(message) > self._host.budget.reply_bytes:
            if not self._host.is_frozen:
                self.close()
            return
        self._enqueue(message)

    def stream(self, package: bytes) -> bool:
        """Send a package that may be left out when the peer lags, and tell whether it was taken."""
        if not self.has_room(len(package)):
            return False
        self._enqueue(package)
        return True

    def has_room(self, n_bytes: int) -> bool:
        """Tell whether a package of this size would be taken; where the peer lags it counts as left out."""
        if not self._is_open or self._is_closing or self._host.is_frozen:
            return False
        limit = self._host.budget.reply_bytes if self._outbox else self._host.budget.stream_bytes
        if self.n_unsent and self.n_unsent + n_bytes > limit:
            self.n_skipped += 1
            return False
        return True

    def close(self) -> None:
        """End the connection now; unsent bytes are lost."""
        if self._is_open:
            self._is_open = False
            self._host.forget(self, self._socket)
            self._socket.close()

    def close_when_sent(self) -> None:
        """End the connection after what was said so far has left."""
        self._is_closing = True
        if not self._unsent and not self._outbox:
            self.close()

    def read(self) -> None:
        """Take what has arrived, up to the budget, and hand it to the service."""
        if not self._is_open or self._host.is_frozen:
            return
        try:
            chunk = self._socket.recv(self._host.budget.bytes_a_poll)
        except BlockingIOError:
            return
        except OSError:
            self.close()
            return
        if not chunk:
            self.close()
        elif self._is_closing:
            return
        elif self._host.delay_ticks or self._inbox:
            self._inbox.append((self._host.tick + self._host.delay_ticks, chunk))
            self._host.wake(self)
        else:
            self._hand_over(chunk)

    def work(self) -> bool:
        """Deliver what was delayed or unsent, and tell whether anything is left."""
        tick = self._host.tick
        while self._is_open and self._inbox and self._inbox[0][0] <= tick:
            self._hand_over(self._inbox.popleft()[1])
        while self._outbox and self._outbox[0][0] <= tick:
            chunk = self._outbox.popleft()[1]
            self._n_delayed -= len(chunk)
            self._unsent += chunk
        if self._is_open and self._unsent:
            self._send()
        return self._is_open and bool(self._unsent or self._inbox or self._outbox)

    def _hand_over(self, chunk: bytes) -> None:
        # Replies leave together: one system call for each of a thousand tiny messages would cost several ticks.
        self._is_gathering = True
        self._host.service.received(self, chunk)
        self._is_gathering = False
        if self._is_open and self._unsent:
            self._send()
            if self._is_open and self._unsent:
                self._host.wake(self)

    def _enqueue(self, message: bytes) -> None:
        if self._host.delay_ticks or self._outbox:
            self._outbox.append((self._host.tick + self._host.delay_ticks, message))
            self._n_delayed += len(message)
        else:
            self._unsent += message
            if self._is_gathering:
                return
            if not self._host.is_frozen:
                self._send()
        if self._is_open and (self._unsent or self._outbox):
            self._host.wake(self)

    def _send(self) -> None:
        try:
            del self._unsent[: self._socket.send(self._unsent)]
        except BlockingIOError:
            return
        except OSError:
            self.close()
            return
        if self._is_closing and not self._unsent and not self._outbox:
            self.close()
