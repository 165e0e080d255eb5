"""A link that is lost while nobody ticks is told once, from a thread, in milliseconds."""

import socket
from contextlib import closing
from itertools import count
from threading import Event

import pytest

from robot.hal import link_guard
from robot.hal.link_guard import LinkGuard
from robot.hal.link_watch import LinkWatch

pytestmark = pytest.mark.realtime

HOST = "127.0.0.37"
SOON_S = 5.0


class Bench:
    """A guarded connection and a controller's time, which goes on or stands still."""

    def __init__(self, server):
        self.ours = socket.create_connection(server.getsockname())
        self.theirs, _ = server.accept()
        self.links = LinkWatch(HOST, server.getsockname()[1])
        self.now, self.is_still, self.lost, self.n_looks = count(), False, Event(), 0
        self.guard = LinkGuard(self.links, timestamp_s=self.timestamp_s, when_lost=self.lost.set)

    def timestamp_s(self):
        self.n_looks += 1
        return -2.0 if self.is_still else float(next(self.now))

    def close(self):
        self.guard.end()
        self.ours.close()
        self.theirs.close()


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.setattr(link_guard, "LOOK_S", 0.02)
    with closing(socket.create_server((HOST, 0))) as server:
        made = Bench(server)
        yield made
        made.close()


def test_a_link_that_stands_while_time_goes_on_is_left_alone(bench):
    bench.links.look()
    bench.guard.begin()
    while bench.n_looks < 3 * link_guard.N_LOOKS:
        assert not bench.lost.wait(0.01)


def test_a_cut_is_told_whether_watched_before_or_since(bench):
    bench.guard.begin()
    bench.links.look()
    bench.theirs.close()
    assert bench.lost.wait(SOON_S)


def test_a_controller_whose_time_stands_still_is_lost_though_its_link_stands(bench):
    bench.links.look()
    bench.is_still = True
    bench.guard.begin()
    assert bench.lost.wait(SOON_S)
    assert bench.n_looks >= link_guard.N_LOOKS


def test_what_is_forgotten_may_end(bench):
    bench.links.look()
    bench.guard.begin()
    bench.links.forget()
    bench.theirs.close()
    n_looks = bench.n_looks
    while bench.n_looks < n_looks + 3:
        assert not bench.lost.wait(0.01)


def test_a_cut_that_somebody_who_ticks_has_seen_is_his_to_tell(bench, monkeypatch):
    monkeypatch.setattr(link_guard, "GRACE_S", SOON_S)
    bench.links.look()
    bench.guard.begin()
    bench.theirs.close()
    assert bench.links.is_cut()
    bench.guard.end()
    assert not bench.lost.is_set()
