"""Sockets polled by hand: bounds, slow readers, faults."""

import errno
import socket

import pytest

from sim_twin.controller.wire.peer import Budget
from sim_twin.controller.wire.reactor import Reactor
from tests.support.wire_doubles import HOST, Client

pytestmark = pytest.mark.realtime


class Echo:
    """Sends back what it receives, and notes what happens."""

    def __init__(self):
        self.peers = []
        self.chunks = []
        self.n_closed = 0

    def opened(self, peer):
        self.peers.append(peer)

    def received(self, peer, chunk):
        self.chunks.append(chunk)
        peer.reply(chunk)

    def closed(self, peer):
        self.n_closed += 1
        self.peers.remove(peer)


@pytest.fixture
def reactor():
    with Reactor() as reactor:
        yield reactor


@pytest.fixture
def echo():
    return Echo()


@pytest.fixture
def port(reactor, echo):
    return reactor.listen(HOST, 0, echo)


@pytest.fixture
def connect(reactor, port):
    clients = []

    def connect(**options):
        client = Client(port.number, reactor.poll, **options)
        clients.append(client)
        return client

    yield connect
    for client in clients:
        client.socket.close()


def open_one(reactor, echo, connect, **options):
    client = connect(**options)
    n = len(echo.peers) + 1
    client.until(lambda: len(echo.peers) == n)
    return client, echo.peers[-1]


def test_what_is_said_comes_back_without_delay(connect):
    client = connect()
    client.send(b"hello")
    assert client.take(5) == b"hello"


def test_a_poll_of_nothing_does_nothing(reactor, port):
    for _ in range(10):
        reactor.poll()
    assert reactor.n_peers == 0


def test_peers_are_counted_and_forgotten(reactor, echo, connect):
    first, _ = open_one(reactor, echo, connect)
    open_one(reactor, echo, connect)
    assert reactor.n_peers == 2
    first.socket.close()
    first = connect()
    first.until(lambda: echo.n_closed == 1 and reactor.n_peers == 2)


def test_nagle_is_off(reactor, echo, connect):
    _, peer = open_one(reactor, echo, connect)
    assert peer._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_one_poll_reads_no_more_than_the_budget(reactor, echo, connect):
    client, _ = open_one(reactor, echo, connect)
    client.send(b"x" * 20_000)
    client.take(20_000)
    assert max(len(chunk) for chunk in echo.chunks) <= Budget().bytes_a_poll
    assert len(echo.chunks) >= 20_000 // Budget().bytes_a_poll


def test_one_poll_accepts_no_more_than_the_budget(reactor, echo, port, connect):
    for _ in range(9):
        connect()
    counts = []
    for _ in range(4):
        reactor.poll()
        counts.append(len(port.peers))
    assert counts == [4, 8, 9, 9]


def test_one_peer_too_many_is_closed_at_once(reactor, echo):
    port = reactor.listen(HOST, 0, echo, Budget(n_peers=1))
    with Client(port.number, reactor.poll) as first, Client(port.number, reactor.poll) as second:
        assert second.ended()
        first.send(b"still here")
        assert first.take(10) == b"still here"


def test_a_taken_port_is_named_in_the_error(reactor, port, echo):
    with pytest.raises(OSError, match=f"{HOST}:{port.number}") as caught:
        reactor.listen(HOST, port.number, echo)
    assert caught.value.errno == errno.EADDRINUSE


def test_a_stream_leaves_packages_out_for_a_client_that_does_not_read(reactor, echo, connect):
    slow, peer = open_one(reactor, echo, connect, n_receive_bytes=4096)
    other, _ = open_one(reactor, echo, connect)
    package = b"p" * 1000
    taken = 0
    for _ in range(3000):
        taken += peer.stream(package)
        reactor.poll()
    assert peer.is_open
    assert peer.n_skipped > 0
    assert peer.n_unsent <= Budget().stream_bytes
    other.send(b"undisturbed")
    assert other.take(11) == b"undisturbed"
    # What was taken arrives whole: no package is cut in the middle.
    assert slow.take(taken * 1000) == package * taken
    assert peer.stream(b"again")
    assert slow.take(5) == b"again"


def test_a_client_that_does_not_read_its_replies_is_dropped(reactor, echo, connect):
    slow, peer = open_one(reactor, echo, connect, n_receive_bytes=4096)
    for _ in range(2000):
        peer.reply(b"r" * 1000)
        reactor.poll()
    assert not peer.is_open
    assert echo.n_closed == 1
    peer.reply(b"nobody")
    assert not peer.stream(b"nobody")
    assert slow.ended()


def test_closing_after_the_last_word_lets_it_arrive(reactor, echo, connect):
    client, peer = open_one(reactor, echo, connect)
    peer.reply(b"bye")
    peer.close_when_sent()
    assert client.ended()
    assert client.stock == b"bye"


def test_a_frozen_port_neither_reads_nor_sends_and_then_goes_on(reactor, echo, port, connect):
    client, peer = open_one(reactor, echo, connect)
    port.is_frozen = True
    client.send(b"later")
    late = connect()
    assert client.silent()
    assert not peer.stream(b"lost")
    peer.reply(b"kept ")
    assert client.silent()
    assert len(port.peers) == 1
    port.is_frozen = False
    assert client.take(10) == b"kept later"
    late.until(lambda: len(port.peers) == 2)


def test_dropped_peers_may_come_back(reactor, echo, port, connect):
    client, _ = open_one(reactor, echo, connect)
    port.drop_peers()
    assert client.ended()
    open_one(reactor, echo, connect)


def test_a_refusing_port_keeps_those_it_has_and_takes_no_more(reactor, echo, port, connect):
    client, _ = open_one(reactor, echo, connect)
    port.refuse()
    assert port.is_refusing
    with pytest.raises(ConnectionRefusedError):
        connect()
    client.send(b"on")
    assert client.take(2) == b"on"
    port.listen()
    port.listen()
    open_one(reactor, echo, connect)


@pytest.mark.parametrize("n", [1, 3, 20])
def test_a_delay_holds_every_word_back_by_that_many_polls_each_way(reactor, echo, port, connect, n):
    client, _ = open_one(reactor, echo, connect)
    port.delay_ticks = n
    client.send(b"ab")
    n_polls = 0
    while not client.stock:
        reactor.poll()
        client.read()
        n_polls += 1
        assert n_polls < 100
    assert 2 * n <= n_polls <= 2 * n + 3
    port.delay_ticks = 0
    client.send(b"cd")
    assert client.take(4) == b"abcd"


def test_closing_twice_is_closing_once(reactor, port):
    reactor.close()
    reactor.close()
    reactor.poll()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((HOST, port.number))
