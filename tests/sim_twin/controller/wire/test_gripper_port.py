"""The gripper's text protocol."""

import numpy as np
import pytest

from sim_twin.controller.wire import GripperMeasurement, GripperRequest

pytestmark = pytest.mark.realtime


@pytest.fixture
def client(bench):
    return bench.client(63352)


def test_set_is_acknowledged_without_a_newline(client, bench):
    client.send(b"SET ACT 1\n")
    assert client.take(3) == b"ack"
    assert client.silent()
    assert bench.robot.requests == [GripperRequest(act=1)]


def test_several_values_are_one_request(client, bench):
    client.send(b"SET POS 255 SPE 128 FOR 0 GTO 1\n")
    assert client.take(3) == b"ack"
    assert bench.robot.requests == [GripperRequest(pos=255, spe=128, force=0, gto=1)]


def test_what_was_set_stays_until_it_is_set_again(client, bench):
    client.send(b"SET ACT 1\nSET POS 9\n")
    assert client.take(6) == b"ackack"
    assert bench.robot.requests[-1] == GripperRequest(act=1, pos=9)


@pytest.mark.parametrize("name", ["ACT", "GTO", "ATR", "ARD", "ADR", "SPE", "FOR"])
def test_a_request_can_be_read_back(client, name):
    assert client.ask(f"GET {name}") == f"{name} 0"
    client.send(f"SET {name} 1\n".encode())
    assert client.take(3) == b"ack"
    assert client.ask(f"GET {name}") == f"{name} 1"


def test_measurements_come_from_the_gripper(client, bench):
    bench.robot.gripper = GripperMeasurement(pos=123, pre=200, sta=3, obj=2, flt=9)
    lines = {name: client.ask(f"GET {name}") for name in ("POS", "PRE", "STA", "OBJ", "FLT")}
    assert lines == {"POS": "POS 123", "PRE": "PRE 200", "STA": "STA 3", "OBJ": "OBJ 2", "FLT": "FLT 9"}


def test_several_questions_at_once_are_answered_line_by_line(client):
    client.send(b"GET POS\nGET STA\nGET OBJ\n")
    assert [client.line() for _ in range(3)] == ["POS 3", "STA 0", "OBJ 0"]


def test_without_power_every_value_is_a_question_mark(client, bench):
    bench.robot.gripper = GripperMeasurement(pos=0, pre=0, sta=0, obj=0, is_powered=False)
    assert client.ask("GET POS") == "POS ?"
    assert client.ask("GET ACT") == "ACT ?"


@pytest.mark.parametrize(
    "line",
    [
        *("GET XYZ", "SET XYZ 1", "SET POS", "SET POS x", "SET POS 256", "SET POS -1", "SET ACT 2", "SET POS ²"),
        *("SET STA 3", "SET", "GET", "GET POS STA", "hello", "SET POS 1 SPE", "SET POS 99999999", "get pos"),
    ],
)
def test_what_is_not_understood_is_answered_with_a_question_mark_and_changes_nothing(client, bench, line):
    assert client.ask(line) == "?"
    assert bench.robot.requests == []


def test_clients_share_one_gripper(client, bench):
    other = bench.client(63352)
    client.send(b"SET POS 77 GTO 1\n")
    assert client.take(3) == b"ack"
    other.send(b"SET SPE 5\n")
    assert other.take(3) == b"ack"
    assert bench.robot.requests[-1] == GripperRequest(pos=77, gto=1, spe=5)


def test_thousands_of_malformed_lines_leave_the_second_client_undisturbed(client, bench):
    rng = np.random.default_rng(63352)
    other = bench.client(63352)
    words = [b"SET", b"GET", b"POS", b"ACT", b"1", b"999", b"-1", b"\xff", b"\0", b"\xb2", b"\n", b"1e3", b"SID"]
    for i in range(4000):
        client.send(b" ".join([words[k] for k in rng.integers(0, len(words), 5)]) + rng.bytes(int(rng.integers(0, 9))))
        bench.wires.poll()
        client.read()
        client.stock = b""
        if client.is_ended:
            client.socket.close()
            client = bench.client(63352)
        if i % 10 == 0:
            assert other.ask("GET STA") == "STA 0"
    assert all(0 <= request.pos <= 255 and 0 <= request.act <= 1 for request in bench.robot.requests)


def test_a_line_without_end_costs_the_connection(client):
    client.send(b"G" * 2000)
    assert client.ended()
