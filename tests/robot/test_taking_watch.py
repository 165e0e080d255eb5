"""A controller that hangs up or falls silent while command is taken is told, whatever who takes it knows."""

import socket
import struct
from contextlib import contextmanager
from threading import Event, Thread
from time import monotonic

import pytest

from robot.errors import WireError
from robot.hal.taking_watch import GRACE_S, LOOK_S, N_SILENT, TakingWatch
from tests.support.loopback import own_address

pytestmark = pytest.mark.realtime

ANSWERS = {"V": b"\x01", "O": b"\x01DOUBLE", "S": b"\x01"}
LATE_S = 0.2
"""More than it may take here, on a machine with other things to do."""


class Controller:
    """Answers like an RTDE port, and tells its time until told to be silent, to stand still or to hang up."""

    def __init__(self, host):
        self.heard, self._host = [], host
        self.is_silent, self.is_still, self._is_over = Event(), Event(), Event()
        self._listening = socket.create_server((host, 0))
        self.port = self._listening.getsockname()[1]
        self._thread = Thread(target=self._run)
        self._thread.start()

    def hang_up(self):
        self._is_over.set()
        self._thread.join()

    def close(self):
        self._is_over.set()
        with socket.socket() as knock:
            knock.connect_ex((self._host, self.port))
        self._thread.join()
        self._listening.close()

    def _run(self):
        link, _ = self._listening.accept()
        with link:
            while not self._is_over.is_set() and self.heard[-1:] != ["S"]:
                head = link.recv(3)
                if not head:
                    return
                size, kind = struct.unpack(">HB", head)
                payload = link.recv(size - 3) if size > 3 else b""
                self.heard.append(chr(kind))
                assert chr(kind) != "O" or payload[8:] == b"timestamp"
                answer = ANSWERS[chr(kind)]
                link.sendall(struct.pack(">HB", 3 + len(answer), kind) + answer)
            time_s = 0.5
            while not self._is_over.wait(0.008):
                time_s += 0.0 if self.is_still.is_set() else 0.008
                if not self.is_silent.is_set():
                    link.sendall(struct.pack(">HBBd", 12, ord("U"), 1, time_s))


@contextmanager
def watched():
    told = []
    host = own_address()
    controller = Controller(host)
    try:
        with TakingWatch(host, when_lost=lambda: told.append(monotonic()), port=controller.port) as watch:
            yield controller, watch, told
    finally:
        controller.close()


def await_told(told, within_s=2.0):
    end_s = monotonic() + within_s
    while not told and monotonic() < end_s:
        Event().wait(0.002)
    return told


def test_nothing_is_told_of_a_controller_that_goes_on_and_nothing_is_written_to_it():
    with watched() as (controller, watch, told):
        assert not await_told(told, within_s=0.3)
    assert controller.heard == ["V", "O", "S"]
    assert watch.why is None


@pytest.mark.parametrize(
    ("wrong", "why", "earliest_s"),
    [
        (Controller.hang_up, "hung up", GRACE_S),
        (lambda controller: controller.is_silent.set(), "said nothing", LOOK_S * (N_SILENT - 1)),
        (lambda controller: controller.is_still.set(), "stood still", 0.008 * (N_SILENT - 1)),
    ],
)
def test_one_that_hangs_up_falls_silent_or_stands_still_is_told_once_within_its_time(wrong, why, earliest_s):
    with watched() as (controller, watch, told):
        begun_s = monotonic()
        wrong(controller)
        (told_s,) = await_told(told)
        assert earliest_s * 0.9 < told_s - begun_s < earliest_s + LATE_S
        assert why in watch.why
        Event().wait(2 * LOOK_S * N_SILENT)
        assert len(told) == 1


def test_a_cut_is_left_to_whoever_ends_meanwhile():
    with watched() as (controller, watch, told):
        controller.hang_up()
    assert not told
    assert watch.why is None


def test_where_nobody_answers_it_says_so_at_once():
    with pytest.raises(WireError, match="expected an answer at"), TakingWatch(own_address(), when_lost=pytest.fail):
        pass
