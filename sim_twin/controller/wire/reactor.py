"""The only place with sockets: listening ports and their peers, polled by hand once a tick.

Nothing here blocks, sleeps or keeps time. One poll reads at most `Budget.bytes_a_poll` of each peer, so a flood on one
connection costs a bounded slice of the tick and never starves the others.
"""

import selectors
from collections import deque
from collections.abc import Callable
from socket import AF_INET, IPPROTO_TCP, SO_REUSEADDR, SO_SNDBUF, SOCK_STREAM, SOL_SOCKET, TCP_NODELAY, socket
from typing import Protocol, Self

import msgspec

__all__ = ["Budget", "Peer", "Port", "Reactor", "Service"]

_BACKLOG = 16
# Without it the kernel lets seconds of old states pile up for a client that does not read.
_KERNEL_SEND_BYTES = 131_072


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


class Peer:
    """One connection.

    Attributes:
        address: The peer's IP address and port.
        n_skipped: Packages of streams that were left out because the peer did not read.
    """

    def __init__(self, connection: socket, address: tuple[str, int], port: "Port") -> None:
        self.address = address
        self.n_skipped = 0
        self._socket = connection
        self._port = port
        self._unsent = bytearray()
        self._is_closing = False
        self._is_open = True
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
        if self.n_unsent and self.n_unsent + len(message) > self._port.budget.reply_bytes:
            if not self._port.is_frozen:
                self.close()
            return
        self._enqueue(message)

    def stream(self, package: bytes) -> bool:
        """Send a package that may be left out when the peer lags, and tell whether it was taken."""
        if not self._is_open or self._is_closing or self._port.is_frozen:
            return False
        limit = self._port.budget.reply_bytes if self._outbox else self._port.budget.stream_bytes
        if self.n_unsent and self.n_unsent + len(package) > limit:
            self.n_skipped += 1
            return False
        self._enqueue(package)
        return True

    def close(self) -> None:
        """End the connection now; unsent bytes are lost."""
        if self._is_open:
            self._is_open = False
            self._port.forget(self, self._socket)
            self._socket.close()

    def close_when_sent(self) -> None:
        """End the connection after what was said so far has left."""
        self._is_closing = True
        if not self._unsent and not self._outbox:
            self.close()

    def read(self) -> None:
        """Take what has arrived, up to the budget, and hand it to the service."""
        if not self._is_open or self._port.is_frozen:
            return
        try:
            chunk = self._socket.recv(self._port.budget.bytes_a_poll)
        except BlockingIOError:
            return
        except OSError:
            self.close()
            return
        if not chunk:
            self.close()
        elif self._is_closing:
            return
        elif self._port.delay_ticks or self._inbox:
            self._inbox.append((self._port.tick + self._port.delay_ticks, chunk))
            self._port.wake(self)
        else:
            self._port.service.received(self, chunk)

    def work(self) -> bool:
        """Deliver what was delayed or unsent, and tell whether anything is left."""
        tick = self._port.tick
        while self._is_open and self._inbox and self._inbox[0][0] <= tick:
            self._port.service.received(self, self._inbox.popleft()[1])
        while self._outbox and self._outbox[0][0] <= tick:
            chunk = self._outbox.popleft()[1]
            self._n_delayed -= len(chunk)
            self._unsent += chunk
        if self._is_open and self._unsent:
            self._send()
        return self._is_open and bool(self._unsent or self._inbox or self._outbox)

    def _enqueue(self, message: bytes) -> None:
        if self._port.delay_ticks or self._outbox:
            self._outbox.append((self._port.tick + self._port.delay_ticks, message))
            self._n_delayed += len(message)
        else:
            self._unsent += message
            if not self._port.is_frozen:
                self._send()
        if self._is_open and (self._unsent or self._outbox):
            self._port.wake(self)

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


class Port:
    """One listening socket, its peers and its faults.

    Attributes:
        service: What answers.
        budget: What each peer is granted.
        number: The TCP port, known once it listens.
        delay_ticks: Fault: polls by which everything said in either direction is late.
        is_frozen: Fault: nothing is accepted, read or sent, as if the controller's process stood still.
        tick: Polls so far.
    """

    def __init__(
        self, selector: selectors.BaseSelector, host: str, number: int, service: Service, budget: Budget
    ) -> None:
        self.service = service
        self.budget = budget
        self.number = number
        self.delay_ticks = 0
        self.is_frozen = False
        self.tick = 0
        self._host = host
        self._selector = selector
        self._listening: socket | None = None
        self._peers: list[Peer] = []
        self._busy: set[Peer] = set()

    @property
    def peers(self) -> tuple[Peer, ...]:
        """The open connections, oldest first."""
        return tuple(self._peers)

    @property
    def is_refusing(self) -> bool:
        """Whether new connections are refused."""
        return self._listening is None

    def listen(self) -> None:
        """Accept connections; also ends `refuse`.

        Raises:
            OSError: The address is taken or is none of this machine's.
        """
        if self._listening is not None:
            return
        listening = socket(AF_INET, SOCK_STREAM)
        listening.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        listening.setblocking(False)
        try:
            listening.bind((self._host, self.number))
            listening.listen(_BACKLOG)
        except OSError as cause:
            listening.close()
            raise OSError(
                cause.errno,
                f"expected to listen on {self._host}:{self.number}: {cause.strerror}; "
                "choose another loopback address or end what holds the port",
            ) from cause
        self.number = listening.getsockname()[1]
        self._listening = listening
        self._selector.register(listening, selectors.EVENT_READ, self._accept)

    def refuse(self) -> None:
        """Fault: refuse new connections until `listen`; those that stand go on."""
        if self._listening is not None:
            self._selector.unregister(self._listening)
            self._listening.close()
            self._listening = None

    def drop_peers(self) -> None:
        """Fault: cut every connection; new ones are still accepted."""
        for peer in self.peers:
            peer.close()

    def close(self) -> None:
        """Cut every connection and stop listening."""
        self.refuse()
        self.drop_peers()

    def poll(self) -> None:
        """Give each peer that is behind its turn."""
        self.tick += 1
        if self.is_frozen:
            return
        for peer in tuple(self._busy):
            if not peer.work():
                self._busy.discard(peer)

    def wake(self, peer: Peer) -> None:
        """Note that a peer has work left for the next poll."""
        self._busy.add(peer)

    def forget(self, peer: Peer, connection: socket) -> None:
        """Strike a peer that closes off the lists."""
        self._selector.unregister(connection)
        self._peers.remove(peer)
        self._busy.discard(peer)
        self.service.closed(peer)

    def _accept(self) -> None:
        if self.is_frozen:
            return
        for _ in range(self.budget.accepts_a_poll):
            if self._listening is None:
                return
            try:
                connection, address = self._listening.accept()
            except OSError:  # nobody left to accept, or one that hung up before its turn
                return
            if len(self._peers) >= self.budget.n_peers:
                connection.close()
                continue
            connection.setblocking(False)
            connection.setsockopt(IPPROTO_TCP, TCP_NODELAY, 1)
            connection.setsockopt(SOL_SOCKET, SO_SNDBUF, _KERNEL_SEND_BYTES)
            peer = Peer(connection, address, self)
            self._peers.append(peer)
            self._selector.register(connection, selectors.EVENT_READ, peer.read)
            self.service.opened(peer)


class Reactor:
    """All ports of one controller, in one thread.

    The owner calls `poll` once a tick; services answer inside that call.
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._ports: list[Port] = []
        self._is_closed = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def ports(self) -> tuple[Port, ...]:
        """The ports in the order in which they were opened; faults are set on each."""
        return tuple(self._ports)

    @property
    def n_peers(self) -> int:
        """Open connections of all ports."""
        return sum(len(port.peers) for port in self._ports)

    def listen(self, host: str, number: int, service: Service, budget: Budget | None = None) -> Port:
        """Open a port for a service; number 0 takes a free one.

        Raises:
            OSError: The address is taken or is none of this machine's.
        """
        port = Port(self._selector, host, number, service, budget or Budget())
        port.listen()
        self._ports.append(port)
        return port

    def poll(self) -> None:
        """Accept, read and send what is possible now; never wait."""
        if self._is_closed:
            return
        for key, _ in self._selector.select(0):
            turn: Callable[[], None] = key.data
            turn()
        for port in self._ports:
            port.poll()

    def close(self) -> None:
        """Close every port and connection; a second call does nothing."""
        if not self._is_closed:
            self._is_closed = True
            for port in self._ports:
                port.close()
            self._selector.close()
