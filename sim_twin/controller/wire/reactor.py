"""Listening ports and their peers in one thread, polled by hand once a tick.

Nothing here blocks, sleeps or keeps time. One poll reads at most `Budget.bytes_a_poll` of each peer, so a flood on one
connection costs a bounded slice of the tick and never starves the others.
"""

import selectors
from collections.abc import Callable
from socket import AF_INET, IPPROTO_TCP, SO_REUSEADDR, SO_SNDBUF, SOCK_STREAM, SOL_SOCKET, TCP_NODELAY, socket
from typing import Self

from sim_twin.controller.wire.peer import Budget, Peer, Service

__all__ = ["Port", "Reactor"]

_BACKLOG = 16
# Without it the kernel lets seconds of old states pile up for a client that does not read.
_KERNEL_SEND_BYTES = 131_072


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
