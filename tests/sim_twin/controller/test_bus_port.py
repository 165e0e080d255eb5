"""Resets over the bus, slice by slice: who asks may find a program that is just ending."""

import socket
import time
from queue import SimpleQueue

import numpy as np
import pytest

from robot.bus import RESET, Bus, ResetRequest, Role
from robot.bus.outlet import Outlet
from robot.bus.topic import key_of
from robot.bus.topics import CellAction
from sim_twin.controller.bus_port import PATIENCE_SLICES, BusPort
from sim_twin.controller.states import Event, RuntimeState
from tests.support.virtual_robot import make_robot, run

pytestmark = pytest.mark.realtime

MOVES = "def f():\n q = get_actual_joint_positions()\n q[0] = q[0] + 0.2\n movej(q, a=8, v=2)\nend\n"
FOREVER = "def waits():\n  while True:\n    sync()\n  end\nend\n"
SLICES_AT_MOST = 1500
UNLOCKABLE_SLICES = 2600


def wrapped(message):
    return Outlet(type(message), source="asker", clock=0, now_ns=time.monotonic_ns).wrap(message)


RESET_3 = wrapped(ResetRequest(seed=3, epoch=1, digital_out=0))


class Cell:
    """A robot, its port, and somebody who asks for a reset."""

    def __init__(self, endpoint):
        self.robot = make_robot()
        self.port = BusPort(self.robot, endpoint)
        serial = self.robot.panel.status().serial_number
        self.asker = Bus(endpoint, serial=serial, role=Role.LEARNING, source="asker")
        self.asker.open()
        self.key = key_of(serial, RESET.name)

    def start(self, text):
        self.robot.submit_script(text)
        run(self.robot, 50, lambda: self.runtime is RuntimeState.PLAYING)

    @property
    def runtime(self):
        return self.robot.machine.modes.runtime

    def ask(self, question=RESET_3):
        """Ask, and let slices pass once the port has the question; return what came and after how many slices."""
        replies = SimpleQueue()
        payload, attachment = question
        self.asker.raw().get(self.key, replies.put, payload=payload, attachment=attachment, timeout=20.0)
        end = time.monotonic() + 10.0
        while not self.port.is_waiting and replies.empty():
            assert time.monotonic() < end
            self.port.tick(1)
        for n in range(SLICES_AT_MOST):
            if not self.port.is_waiting:
                return replies.get(timeout=10.0), n
            self.robot.step()
            self.port.tick(n)
        raise AssertionError("a reset is not waited for without end")

    def close(self):
        self.asker.close()
        self.port.close()
        self.robot.close()


@pytest.fixture
def cell():
    with socket.create_server(("127.0.0.66", 0)) as free:
        endpoint = f"tcp/127.0.0.66:{free.getsockname()[1]}"
    made = Cell(endpoint)
    yield made
    made.close()


def joints(robot):
    return robot.machine.world.data.qpos[:6].copy()


def test_a_reset_at_rest_is_done_at_once(cell):
    before = joints(cell.robot)
    reply, n = cell.ask()
    assert reply.ok is not None
    assert n == 0
    assert np.abs(joints(cell.robot) - before).max() > 0.01


def test_a_reset_waits_for_a_program_that_is_ending_and_an_arm_that_comes_to_rest(cell):
    cell.start(MOVES)
    run(cell.robot, 20)
    assert not cell.robot.is_idle
    reply, n = cell.ask()
    assert reply.ok is not None
    assert 20 < n < PATIENCE_SLICES
    assert cell.robot.is_idle


def test_a_reset_does_not_outwait_a_program_that_goes_on_and_leaves_it_alone(cell):
    cell.start(FOREVER)
    before = joints(cell.robot)
    reply, n = cell.ask()
    assert reply.err is not None
    assert "stop the program first" in reply.err.payload.to_string()
    assert n == PATIENCE_SLICES
    assert cell.runtime is RuntimeState.PLAYING
    assert np.abs(joints(cell.robot) - before).max() < 1e-3


def test_each_reset_has_its_own_patience(cell):
    cell.start(FOREVER)
    assert [cell.ask()[1] for _ in range(2)] == [PATIENCE_SLICES] * 2


def test_what_is_no_reset_request_is_refused_and_neither_unlocks_a_stop_nor_ends_a_program(cell):
    cell.start(FOREVER)
    cell.robot.programs.handle(Event.PROTECTIVE_STOP)
    run(cell.robot, UNLOCKABLE_SLICES)
    modes = cell.robot.machine.modes
    before = (modes.safety, modes.runtime)
    for garbage in (
        (b"", b""),
        (b"reset", RESET_3.attachment),
        (b"[1, 2]", RESET_3.attachment),
        (b'{"seed": "three", "epoch": 0, "digital_out": 0}', RESET_3.attachment),
        (b"\xff\xfe", RESET_3.attachment),
        (RESET_3.payload, b""),
        (RESET_3.payload, RESET_3.attachment[:-1]),
        (RESET_3.payload, wrapped(CellAction()).attachment),
    ):
        reply, n = cell.ask(garbage)
        assert "reset: " in reply.err.payload.to_string()
        assert n == 0
        assert (modes.safety, modes.runtime) == before
        assert modes.is_stopped_by_safety
    assert cell.ask()[0].ok is not None
    assert not modes.is_stopped_by_safety
