"""RTDE over real sockets: both protocols, recipes, arbitration, pace, rough clients."""

import struct

import numpy as np
import pytest

from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.reactor import Reactor
from sim_twin.controller.wire.rtde_codec import Level
from sim_twin.controller.wire.rtde_server import RtdeServer
from tests.support.wire_doubles import HOST, Client

pytestmark = pytest.mark.realtime

NAN = float("nan")


def data(client):
    letter, payload = client.frame()
    assert letter == "U"
    return payload


def n_packages(bench, client, n_steps):
    """Count the data packages of so many control steps."""
    for step in range(1, n_steps + 1):
        bench.wires.tick(step)
    client.silent(100)
    n, stock = 0, client.stock
    while stock:
        (size,) = struct.unpack_from(">H", stock)
        assert stock[2:3] == b"U"
        n, stock = n + 1, stock[size:]
    client.stock = b""
    return n


def test_versions_of_the_protocol(bench):
    client = bench.client(30004)
    assert client.rtde("V", b"\x00\x03") == b"\x00"
    assert client.rtde("V", b"\x00\x02") == b"\x01"
    assert client.rtde("V", b"\x00\x01") == b"\x01"


def test_the_controller_tells_the_announced_version(make_bench):
    bench = make_bench(ControllerVersion(major=5, minor=23, bugfix=1, build=77))
    assert struct.unpack(">4I", bench.rtde().rtde("v")) == (5, 23, 1, 77)


def test_an_output_recipe_is_answered_with_its_types(bench):
    assert bench.rtde().outputs("timestamp,actual_q,robot_mode") == b"\x01DOUBLE,VECTOR6D,INT32"
    assert bench.rtde(1).rtde("O", b"timestamp,actual_q,") == b"DOUBLE,VECTOR6D"


def test_a_message_may_arrive_byte_by_byte(bench):
    client = bench.rtde()
    payload = struct.pack(">d", 125.0) + b"timestamp,actual_q"
    for byte in struct.pack(">HB", 3 + len(payload), ord("O")) + payload:
        client.send(bytes([byte]))
        bench.wires.poll()
    assert client.frame() == ("O", b"\x01DOUBLE,VECTOR6D")


def test_data_flows_between_start_and_pause(bench):
    client = bench.rtde()
    client.outputs("timestamp,actual_q,robot_mode,actual_digital_input_bits")
    bench.wires.tick(1)
    assert client.silent()
    assert client.rtde("S") == b"\x01"
    bench.robot.numbers |= {
        "timestamp": 1.25,
        "actual_q": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        "robot_mode": -1,
        "actual_digital_input_bits": 2**40 + 5,
    }
    bench.wires.tick(2)
    expected = struct.pack(">B7diQ", 1, 1.25, 1, 2, 3, 4, 5, 6, -1, 2**40 + 5)
    assert data(client) == expected
    assert client.rtde("P") == b"\x01"
    bench.wires.tick(3)
    assert client.silent()
    assert client.rtde("S") == b"\x01"
    bench.wires.tick(4)
    assert data(client) == expected


def test_protocol_1_has_no_recipe_ids_and_125_hz(bench):
    client = bench.rtde(1)
    client.rtde("O", b"timestamp")
    assert client.rtde("I", b"input_int_register_0") == b"INT32"
    assert client.rtde("S") == b"\x01"
    bench.robot.numbers["timestamp"] = 4.0
    bench.wires.tick(4)
    assert data(client) == struct.pack(">d", 4.0)
    assert n_packages(bench, client, 500) == 125
    client.say("U", struct.pack(">i", 9))
    client.until(lambda: bench.robot.written)
    assert bench.robot.written == [("input_int_register_0", 9)]


@pytest.mark.parametrize("rate_hz", [200.0, 300.0, 400.0, 166.0, 1.0])
def test_a_rate_that_does_not_divide_500_is_exact_on_average_and_every_package_at_a_slice(bench, rate_hz):
    client = bench.rtde()
    client.outputs("timestamp", rate_hz)
    client.rtde("S")
    sent_at = []
    for step in range(1, 1001):
        bench.robot.numbers["timestamp"] = float(step)
        bench.wires.tick(step)
        client.read()
    client.silent(100)
    while client.stock:
        sent_at.append(struct.unpack(">d", client.take(12)[4:])[0])
    assert len(sent_at) == 2 * rate_hz
    late = np.array(sent_at) - np.arange(1, len(sent_at) + 1) * 500.0 / rate_hz
    assert (late >= 0.0).all()
    assert (late < 1.0).all()


@pytest.mark.parametrize(
    ("rate_hz", "n"),
    [
        *((500.0, 500), (499.0, 499), (250.0, 250), (125.0, 125), (10.0, 10), (1.0, 1), (2000.0, 500)),
        *((0.0, 500), (-1.0, 500), (NAN, 500), (float("inf"), 500), (1e-300, 0)),
    ],
)
def test_each_client_has_its_own_pace(bench, rate_hz, n):
    client, other = bench.rtde(), bench.rtde()
    client.outputs("timestamp", rate_hz)
    other.outputs("timestamp", 50.0)
    assert client.rtde("S") == other.rtde("S") == b"\x01"
    assert n_packages(bench, client, 500) == n
    assert n_packages(bench, other, 0) == 50


def test_a_cb3_is_never_faster_than_125_hz(make_bench):
    bench = make_bench(ControllerVersion(major=3, minor=15, bugfix=8))
    client = bench.rtde()
    slower = bench.rtde()
    client.outputs("timestamp", 500.0)
    slower.outputs("timestamp", 100.0)
    assert client.rtde("S") == slower.rtde("S") == b"\x01"
    assert n_packages(bench, client, 500) == 125
    assert n_packages(bench, slower, 0) == 100


def test_an_unknown_output_is_not_found_and_leaves_no_recipe(bench):
    client = bench.rtde()
    assert client.outputs("timestamp,actual_current_as_torque,nonsense") == b"\x00DOUBLE,NOT_FOUND,NOT_FOUND"
    assert client.rtde("S") == b"\x00"
    letter, text = client.frame()
    assert letter == "M"
    assert b"output recipe" in text


def test_an_output_that_the_robot_does_not_offer_is_not_found(bench):
    server = RtdeServer(outputs={"timestamp": lambda: 0.0}, inputs=bench.robot, version=ControllerVersion())
    with Reactor() as reactor, Client(reactor.listen(HOST, 0, server).number, reactor.poll) as client:
        client.rtde("V", b"\x00\x02")
        assert client.outputs("timestamp,actual_q") == b"\x00DOUBLE,NOT_FOUND"


def test_start_without_outputs_is_refused(bench):
    assert bench.rtde().rtde("S") == b"\x00"


def test_a_new_output_recipe_replaces_the_old_one(bench):
    client = bench.rtde()
    client.outputs("timestamp,actual_q")
    client.rtde("S")
    assert client.outputs("robot_mode") == b"\x01INT32"
    bench.wires.tick(1)
    assert client.silent()
    client.rtde("S")
    bench.wires.tick(1)
    assert data(client) == struct.pack(">Bi", 1, 0)


def test_a_recipe_that_fails_stops_the_data_of_the_one_before(bench):
    client = bench.rtde()
    client.outputs("timestamp")
    client.rtde("S")
    assert client.outputs("nonsense") == b"\x00NOT_FOUND"
    bench.wires.tick(1)
    assert client.silent()


def test_input_recipes_are_numbered_and_written_by_number(bench):
    client = bench.rtde()
    assert client.inputs("input_int_register_0,input_double_register_0") == b"\x01INT32,DOUBLE"
    assert client.inputs("input_int_register_0,external_force_torque") == b"\x02INT32,VECTOR6D"
    client.say("U", struct.pack(">Bi6d", 2, -5, 1, 2, 3, 4, 5, 6))
    client.say("U", struct.pack(">Bid", 1, 7, 0.5))
    client.until(lambda: len(bench.robot.written) == 4)
    assert bench.robot.written == [
        ("input_int_register_0", -5),
        ("external_force_torque", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        ("input_int_register_0", 7),
        ("input_double_register_0", 0.5),
    ]


def test_an_input_belongs_to_one_client_until_it_leaves(bench):
    first, second = bench.rtde(), bench.rtde()
    assert first.inputs("input_int_register_24,input_int_register_25") == b"\x01INT32,INT32"
    assert second.inputs("input_int_register_25,input_int_register_26") == b"\x00IN_USE,INT32"
    # A set-up that failed claims nothing.
    assert first.inputs("input_int_register_26") == b"\x02INT32"
    assert second.inputs("input_int_register_27") == b"\x01INT32"
    first.socket.close()
    second.until(lambda: bench.wires.rtde.n_clients == 1)
    assert second.inputs("input_int_register_25,input_int_register_26") == b"\x02INT32,INT32"


def test_an_input_of_a_field_bus_is_in_use_until_it_is_free_again(bench):
    client = bench.rtde()
    bench.wires.rtde.reserve(["input_int_register_0"])
    assert client.inputs("input_int_register_0") == b"\x00IN_USE"
    bench.wires.rtde.reserve([])
    assert client.inputs("input_int_register_0") == b"\x01INT32"


def test_an_unknown_input_is_not_found_and_claims_nothing(bench):
    first, second = bench.rtde(), bench.rtde()
    assert first.inputs("input_int_register_3,nonsense,actual_q") == b"\x00INT32,NOT_FOUND,NOT_FOUND"
    assert second.inputs("input_int_register_3") == b"\x01INT32"


def test_inputs_are_taken_without_a_start(bench):
    client = bench.rtde()
    client.inputs("standard_digital_output_mask,standard_digital_output")
    client.say("U", b"\x01\x08\x08")
    client.until(lambda: bench.robot.written)
    assert bench.robot.written == [("standard_digital_output_mask", 8), ("standard_digital_output", 8)]


@pytest.mark.parametrize("payload", [b"", b"\x01", b"\x01" + bytes(3), b"\x01" + bytes(5), b"\x09" + bytes(4)])
def test_data_that_fits_no_recipe_writes_nothing_and_is_told(bench, payload):
    client = bench.rtde()
    client.inputs("input_int_register_0")
    client.say("U", payload)
    letter, text = client.frame()
    assert letter == "M"
    assert text[1:].startswith(b"expected")
    assert bench.robot.written == []
    client.say("U", b"\x01" + bytes(4))
    client.until(lambda: bench.robot.written)
    assert bench.robot.written == [("input_int_register_0", 0)]


def test_text_messages_reach_every_started_client_in_its_protocol(bench):
    old, new, idle = bench.rtde(1), bench.rtde(2), bench.rtde(2)
    old.rtde("O", b"timestamp")
    new.outputs("timestamp")
    assert [client.rtde("S") for client in (old, new)] == [b"\x01", b"\x01"]
    bench.wires.rtde.say("stop", level=Level.WARNING, source="safety")
    assert new.frame() == ("M", b"\x04stop\x06safety\x02")
    assert old.frame() == ("M", b"\x02stop")
    assert idle.silent(), "it would take it for the answer to what it asks next"


def test_what_clients_say_is_heard_with_its_source_and_level(bench):
    old, new = bench.rtde(1), bench.rtde(2)
    new.say("M", b"\x02hi\x02me\x03")
    new.until(lambda: len(bench.heard) == 1)
    old.say("M", b"\x02hello")
    old.until(lambda: len(bench.heard) == 2)
    assert bench.heard == ["RTDE client me, level 3: hi", "RTDE client without a name, level 2: hello"]
    assert new.silent()


@pytest.mark.parametrize("payload", [b"", b"\x05hi", b"\x02hi\x02me", b"\x02hi"])
def test_a_text_that_is_shorter_than_it_says_ends_that_client_only(bench, payload):
    rough, other = bench.rtde(), bench.rtde()
    rough.say("M", payload)
    assert rough.ended()
    assert len(other.rtde("v")) == 16
    assert bench.heard == []


def test_an_unknown_message_is_told_and_the_client_stays(bench):
    client = bench.rtde()
    client.say("?", b"what")
    assert client.frame()[0] == "M"
    assert len(client.rtde("v")) == 16


@pytest.mark.parametrize(
    "broken",
    [b"\x00\x00V", b"\x00\x02V\x00\x02", b"\x00\x04V\x02", b"\x00\x03V", b"\x00\x05Oabc", b"\x00\x06V\x00\x00\x02"],
    ids=lambda broken: broken.hex(),
)
def test_a_stream_that_cannot_be_followed_ends_that_client_only(bench, broken):
    rough, other = bench.rtde(), bench.rtde()
    rough.inputs("input_int_register_1")
    rough.send(broken)
    assert rough.ended()
    assert other.inputs("input_int_register_1") == b"\x01INT32"


def test_more_names_than_the_limit_are_refused(bench):
    client = bench.rtde()
    names = ",".join(["actual_q"] * 227)
    assert len(names) <= 2048
    assert client.outputs(names).startswith(b"\x01")
    assert client.outputs(names + ",actual_q,actual_q") == b"\x00"
    assert client.frame()[0] == "M"
    assert client.inputs("") == b"\x00"


def test_a_client_that_does_not_read_loses_packages_and_disturbs_nobody(bench):
    slow, other = bench.client(30004, n_receive_bytes=4096), bench.rtde()
    slow.rtde("V", b"\x00\x02")
    for client in (slow, other):
        client.outputs("actual_q,actual_qd,target_q,target_qd,actual_current", 500.0)
        assert client.rtde("S") == b"\x01"
    n_bytes = 0
    for step in range(3000):
        bench.wires.tick(step)
        bench.wires.poll()
        other.read()
        n_bytes += len(other.stock)
        other.stock = b""
    assert n_bytes == 3000 * (4 + 5 * 48)
    assert bench.wires.rtde.n_started == 2
    slow.silent()
    assert len(slow.stock) % (4 + 5 * 48) == 0


def rough_message(rng):
    """Return bytes of all kinds of wrong: noise, wrong sizes, right frames with noise inside."""
    n = int(rng.integers(0, 40))
    noise = rng.bytes(n)
    kind = b"VvMUOISP?\x00"[int(rng.integers(10)) :][:1]
    words = [b"actual_q", b"timestamp", b"input_int_register_5", b",", b"", bytes(8), b"\x01", noise]
    words = [words[i] for i in rng.integers(0, len(words), 3)]
    match int(rng.integers(4)):
        case 0:
            return noise
        case 1:
            return struct.pack(">H", int(rng.integers(0, 60))) + kind + noise
        case 2:
            return struct.pack(">H", 3 + n) + kind + noise
        case _:
            body = b"".join(words)
            return struct.pack(">H", 3 + len(body)) + kind + body


def test_thousands_of_malformed_messages_leave_the_second_client_undisturbed(bench):
    rng = np.random.default_rng(4)
    other = bench.rtde()
    other.outputs("timestamp")
    other.inputs("input_int_register_40")
    other.rtde("S")
    rough = bench.client(30004)
    n_dropped = 0
    for step in range(4000):
        if rough.is_ended or step % 20 == 0:
            n_dropped += rough.is_ended
            rough.socket.close()
            rough = bench.client(30004)
            if rng.integers(2):
                rough.send(b"\x00\x05V\x00\x02")
        rough.send(rough_message(rng))
        bench.wires.poll()
        bench.wires.tick(step)
        rough.read()
        assert data(other) == struct.pack(">Bd", 1, 0.0)
    assert n_dropped > 20
    assert other.inputs("input_int_register_41") == b"\x02INT32"
    assert all(name != "input_int_register_40" for name, _ in bench.robot.written)
