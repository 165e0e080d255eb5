"""A flood of commands that are nobody's to give: none has an effect, and the rightful source goes on."""

import socket
import threading
import time

import pytest

from robot.bus import Bus, Role
from robot.bus.outlet import Outlet
from robot.bus.station_rows import Command
from robot.bus.topic import key_of
from robot.bus.topics import INTENT
from robot.messages import Heading
from robot.node import NodeAsker, RemoteStation
from sim_twin.operator import SimulatedOperator
from tests.support.robot_node import SERIAL, Node

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.103"
N_FLOOD, HUGE_BYTES = 100_000, 100_000_000
GO = Heading(heading_rad=0.5, distance_m=0.02, height_m=0.2)
AWAY = Heading(heading_rad=-2.6, distance_m=0.02, height_m=0.2)


@pytest.fixture
def lab():
    with socket.create_server((HOST, 0)) as free:
        endpoint = f"tcp/{HOST}:{free.getsockname()[1]}"
    node = Node(endpoint)
    bus = Bus(endpoint, serial=SERIAL, role=Role.LEARNING)
    bus.open()
    station = RemoteStation(bus, asker=NodeAsker(bus, wait_s=5.0))
    SimulatedOperator().arm_once(station)
    station.reset(seed=1, epoch=0)
    yield endpoint, node, station
    station.close()
    node.close()


def flood(endpoint, n, is_over):
    with Bus(endpoint, serial=SERIAL, role=Role.TELEOP, source="intruder") as bus:
        session, key = bus.raw(), key_of(SERIAL, INTENT.name)
        outlet = Outlet(Command, source="intruder", clock=bus.clock, now_ns=time.monotonic_ns)
        for k in range(n):
            sent = outlet.wrap(Command(lease="0123456789abcdef", number=10**9 + k, intent=AWAY))
            session.put(key, sent.payload, attachment=sent.attachment)
        session.put(key, bytes(HUGE_BYTES))
        is_over.set()


def test_a_hundred_thousand_foreign_commands_and_a_huge_one_have_no_effect(lab):
    endpoint, node, station = lab
    is_over, took_ms = threading.Event(), []
    thread = threading.Thread(target=flood, args=(endpoint, N_FLOOD, is_over))
    thread.start()
    start = node.local.measured
    while not is_over.is_set() or not took_ms:
        begun = time.perf_counter()
        result = station.step(GO)
        took_ms.append(1e3 * (time.perf_counter() - begun))
        assert not result.is_void, result.verdicts
        assert result.executed.requested == GO
    thread.join()
    took_ms.sort()
    p99_ms = took_ms[len(took_ms) * 99 // 100]
    assert node.node._admission.n_refused > 1000
    assert node.local.measured != start
    assert p99_ms < 500.0
    assert not station.step(GO).is_void, "it is as before"
