"""A connection that the other side ended is seen before anybody speaks into it."""

import os
import socket
from contextlib import closing

import pytest

from robot.hal.link_watch import LinkWatch

pytestmark = pytest.mark.realtime

HOST = "127.0.0.36"


@pytest.fixture
def pair():
    """Our end of a connection that something else in this process holds, and the other side's."""
    with closing(socket.create_server((HOST, 0))) as server:
        ours = socket.create_connection(server.getsockname())
        theirs, _ = server.accept()
        with ours, theirs:
            yield ours, theirs, server.getsockname()[1]


@pytest.fixture
def watch(pair):
    made = LinkWatch(HOST, pair[2])
    yield made
    made.forget()


def test_a_connection_that_stands_is_not_cut_though_nobody_reads(pair, watch):
    assert watch.look() == 1
    pair[1].sendall(b"state" * 100)
    assert not watch.is_cut()
    assert watch.look() == 1  # the same once more


@pytest.mark.parametrize("is_reset", [False, True])
def test_a_connection_that_was_ended_is_cut(pair, watch, is_reset):
    watch.look()
    if is_reset:
        pair[1].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    pair[1].sendall(b"last words")
    pair[1].close()
    assert watch.is_cut()


def test_it_stays_cut_when_its_holder_has_closed_and_reconnected(pair, watch):
    watch.look()
    pair[1].close()
    pair[0].close()
    assert watch.is_cut()


def test_connections_elsewhere_are_none_of_its_business(pair):
    watch = LinkWatch(HOST, pair[2] + 1)
    assert watch.look() == 0
    pair[1].close()
    assert not watch.is_cut()


def test_nothing_is_left_open_when_it_forgets(pair, watch):
    before = len(os.listdir("/proc/self/fd"))
    watch.look()
    watch.forget()
    assert len(os.listdir("/proc/self/fd")) == before
    assert not watch.is_cut()
