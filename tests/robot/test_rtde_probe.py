"""An RTDE port that does not answer is told in time and by name, on real sockets."""

import socket
import threading
from contextlib import suppress

import pytest

from robot.errors import WireError
from robot.hal.rtde_probe import RTDE_PORT, probe_rtde
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

SHORT_S = 0.2


@pytest.fixture
def port():
    """Return how to have the port answer: to what was asked, by what a function returns; None hangs up."""
    server = socket.create_server((own_address(), RTDE_PORT))
    asked, threads = [], []

    def answer_by(answer):
        def serve():
            connection, _ = server.accept()
            with connection:
                asked.append(connection.recv(64))
                said = answer(asked[-1])
                if said is not None:
                    connection.sendall(said)
                    with suppress(ConnectionResetError):  # what it did not read is thrown away
                        connection.recv(64)  # until the other side hangs up

        threads.append(threading.Thread(target=serve))
        threads[-1].start()
        return server.getsockname()[0], asked

    yield answer_by
    server.close()
    for thread in threads:
        thread.join()


def test_one_that_speaks_version_2_is_well_whatever_pieces_its_answer_comes_in(port):
    host, asked = port(lambda _: b"\x00\x04V\x01")
    probe_rtde(host)
    assert asked == [b"\x00\x05V\x00\x02"]


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (lambda _: b"", "timed out.*RTDE enabled"),
        (lambda _: b"\x00\x04", "timed out"),
        (lambda _: None, "closed by the other side"),
        (lambda _: b"\x00\x04V\x00", "version 2, came 00045600"),
        (lambda _: b"HTTP/1.1", "version 2, came"),
    ],
)
def test_one_that_does_not_is_told(port, answer, why):
    host, _ = port(answer)
    with pytest.raises(WireError, match=why):
        probe_rtde(host, timeout_s=SHORT_S)


def test_nobody_there_is_told():
    with pytest.raises(WireError, match="refused"):
        probe_rtde(own_address(), timeout_s=SHORT_S)
