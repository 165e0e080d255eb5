"""The emulated cable does to packets what it says: TCP between its ends bears all of it but a cut."""

import socket
import threading
import time

import pytest

from tests.support.netns import EmulatedCable, inside, why_not

pytestmark = [pytest.mark.realtime, pytest.mark.slow]
A, B, PORT = "192.168.7.1", "192.168.7.2", 5000
N = 200


@pytest.fixture(scope="module")
def cable():
    why = why_not()
    if why is not None:
        pytest.skip(why)
    with EmulatedCable(A, B) as made:
        yield made


@pytest.fixture
def echo(cable):
    """Return a connection from B to an echo at A."""
    cable.set()
    with inside(cable.a):
        server = socket.create_server((A, PORT))

    def serve():
        with server, server.accept()[0] as peer:
            while True:
                try:
                    got = peer.recv(4096)
                except OSError:
                    return
                if not got:
                    return
                peer.sendall(got)

    thread = threading.Thread(target=serve)
    thread.start()
    with inside(cable.b):
        client = socket.create_connection((A, PORT), timeout=20)
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    yield client
    cable.set()
    client.close()
    thread.join()


def round_trips_s(client, n=N):
    found = []
    for k in range(n):
        word = k.to_bytes(4, "big")
        begun_s = time.monotonic()
        client.sendall(word)
        got = b""
        while len(got) < 4:
            got += client.recv(4 - len(got))
        assert got == word
        found.append(time.monotonic() - begun_s)
    return sorted(found)


def test_a_delay_is_there_both_ways(cable, echo):
    assert round_trips_s(echo)[N // 2] < 0.05
    cable.set(delay_ms=50.0)
    assert 0.1 <= round_trips_s(echo, 10)[5] < 0.2


@pytest.mark.parametrize(
    ("faults", "count"), [({"loss": 0.05}, "lost"), ({"duplicate": 0.2}, "doubled"), ({"reorder": 0.2}, "held_back")]
)
def test_tcp_bears_lost_doubled_and_reordered_packets(cable, echo, faults, count):
    before = cable.counts()
    cable.set(**faults)
    round_trips_s(echo)
    after = cable.counts()
    assert after[count] - before[count] > 0.3 * N * 2 * next(iter(faults.values()))


def test_over_a_cut_nothing_comes_until_it_is_mended(cable, echo):
    round_trips_s(echo, 3)
    cable.set(is_cut=True)
    echo.settimeout(0.5)
    echo.sendall(b"word")
    with pytest.raises(TimeoutError):
        echo.recv(4)
    cable.set()
    echo.settimeout(10)
    assert echo.recv(4) == b"word"
