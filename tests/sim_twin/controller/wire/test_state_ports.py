"""Ports 30001 to 30003 and 30011 to 30013 over real sockets."""

import struct

import numpy as np
import pytest

from sim_twin.controller.wire import ControllerVersion, PortKind
from sim_twin.controller.wire.primary_messages import pack_text
from sim_twin.controller.wire.script_framer import N_PROGRAM_CHARS

pytestmark = pytest.mark.realtime

WRITABLE = {30001: PortKind.PRIMARY, 30002: PortKind.SECONDARY, 30003: PortKind.REALTIME}
PROGRAM = "def p():\n  sync()\nend\n"


def settle(bench, number):
    """Connect, take the greeting if there is one, and return the client."""
    client = bench.client(number)
    client.until(lambda: bench.port(number).peers)
    if number not in (30003, 30013):
        kind, said = client.package()
        assert kind == 20
        assert said[9] == 3
    return client


def count(bench, client, n_steps, first=1):
    """Return the packages' sizes of so many control steps."""
    sizes = []
    for step in range(first, first + n_steps):
        bench.wires.tick(step)
        client.read()
    client.silent(100)
    while client.stock:
        (size,) = struct.unpack_from(">i", client.stock)
        sizes.append(len(client.take(size)))
    return sizes


@pytest.mark.parametrize("number", [30001, 30002, 30011, 30012])
def test_state_comes_at_10_hz(bench, number):
    client = settle(bench, number)
    assert count(bench, client, 500) == [5 + 47] * 10


@pytest.mark.parametrize("number", [30003, 30013])
def test_realtime_state_comes_at_500_hz(bench, number):
    client = settle(bench, number)
    assert count(bench, client, 500) == [1220] * 500


def test_a_cb3_is_four_times_slower(make_bench):
    bench = make_bench(ControllerVersion(major=3, minor=9))
    client = settle(bench, 30003)
    assert count(bench, client, 500) == [1108] * 125


def test_nobody_listening_costs_no_state(bench):
    bench.robot.primary_state = bench.robot.realtime_state = None
    for step in range(100):
        bench.wires.tick(step)


@pytest.mark.parametrize(("number", "kind"), WRITABLE.items())
def test_a_program_is_handed_over_with_its_source(bench, number, kind):
    client = settle(bench, number)
    client.send(PROGRAM.encode())
    client.until(lambda: bench.robot.scripts)
    assert bench.robot.scripts == [(PROGRAM, kind, client.socket.getsockname())]


def test_a_long_program_in_many_segments_arrives_whole(bench):
    client = settle(bench, 30003)
    text = "def rtde_control():\n" + "  sync() # ünïcode\n" * 2500 + "end\n"
    stream = text.encode()
    for at in range(0, len(stream), 1448):
        client.send(stream[at : at + 1448])
        bench.wires.poll()
    client.send(b"stopj(2.0)\n")
    client.until(lambda: len(bench.robot.scripts) == 2)
    assert [script[0] for script in bench.robot.scripts] == [text, "stopj(2.0)\n"]


@pytest.mark.parametrize("number", [30011, 30012, 30013])
def test_a_read_only_port_takes_no_scripts(bench, number):
    client = settle(bench, number)
    client.send(PROGRAM.encode() * 100)
    assert client.silent(50)
    assert bench.robot.scripts == []
    bench.wires.tick(50)
    client.until(lambda: client.stock)


def test_half_a_program_is_never_run(bench):
    client = settle(bench, 30002)
    client.send(PROGRAM[:-1].encode())
    bench.wires.poll()
    client.socket.close()
    other = settle(bench, 30001)
    other.until(lambda: not bench.port(30002).peers)
    assert bench.robot.scripts == []


def test_messages_reach_the_primary_clients_only(bench):
    primary, secondary, read_only = (settle(bench, number) for number in (30001, 30002, 30011))
    bench.wires.states.tell(pack_text("hello", stamp_us=5))
    assert primary.package() == read_only.package() == (20, struct.pack(">QbB", 5, -3, 0) + b"hello")
    assert secondary.silent()


def test_a_flood_of_messages_cuts_nobody_off_and_is_left_out_where_it_is_not_read(bench):
    slow, other = bench.client(30001, n_receive_bytes=4096), settle(bench, 30001)
    message, n_bytes = pack_text("x" * 500, stamp_us=5), 0
    for _ in range(20_000):
        bench.wires.states.tell(message)
        other.read()
        n_bytes += len(other.stock)
        other.stock = b""
    other.silent(100)
    assert n_bytes + len(other.stock) == 20_000 * len(message)
    peers = bench.port(30001).peers
    assert len(peers) == 2
    assert max(peer.n_unsent for peer in peers) <= 16_384
    slow.send(PROGRAM.encode())
    slow.until(lambda: bench.robot.scripts)


def test_a_program_that_is_too_long_is_told_and_its_client_cut_off(bench):
    client = settle(bench, 30002)
    client.send(b"def f():\n" + b" sync() # and on\n" * 16_500)
    client.until(lambda: bench.robot.refused)
    ((why, kind),) = bench.robot.refused
    assert f"at most {N_PROGRAM_CHARS} characters" in why
    assert kind is PortKind.SECONDARY
    assert bench.robot.scripts == []
    assert not bench.port(30002).peers


def test_a_realtime_client_that_never_reads_disturbs_nobody(bench):
    # ur_rtde never reads what comes back on the port where it uploads its script.
    slow, other = bench.client(30003, n_receive_bytes=4096), settle(bench, 30003)
    n_bytes = 0
    for step in range(2000):
        bench.wires.poll()
        bench.wires.tick(step)
        other.read()
        n_bytes += len(other.stock)
        other.stock = b""
    other.silent(100)
    assert n_bytes + len(other.stock) == 2000 * 1220
    slow.send(PROGRAM.encode())
    slow.until(lambda: bench.robot.scripts)


def test_a_realtime_package_that_nobody_takes_is_not_made_until_somebody_reads_again(bench):
    slow = bench.client(30003, n_receive_bytes=4096)
    slow.until(lambda: bench.port(30003).peers)
    make, made = bench.robot.realtime_state, []
    bench.robot.realtime_state = lambda: made.append(None) or make()
    (peer,) = bench.port(30003).peers

    def run(n_steps):
        for step in range(n_steps):
            bench.wires.poll()
            bench.wires.tick(step)

    run(10_000)
    assert peer.n_skipped
    n_made, n_skipped = len(made), peer.n_skipped
    run(500)
    # The kernel's buffers may grow and take a few more: each is made, no other is.
    assert len(made) - n_made == 500 - (peer.n_skipped - n_skipped) < 100
    n_made = len(made)
    slow.until(lambda: not peer.n_unsent)
    run(5)
    assert len(made) == n_made + 5


@pytest.mark.parametrize("number", [30001, 30002, 30003])
def test_thousands_of_malformed_uploads_leave_the_second_client_undisturbed(bench, number):
    rng = np.random.default_rng(number)
    rough, other = settle(bench, number), settle(bench, number)
    words = [b"def ", b"end\n", b"sec \n", b"\xff\xfe", b"\0", b"\n", b"end", b"def f():\n", b"\r", b"  "]
    n = 0
    for step in range(2000):
        rough.send(b"".join(words[k] for k in rng.integers(0, len(words), 4)) + rng.bytes(int(rng.integers(0, 50))))
        bench.wires.poll()
        if step % 50 == 0:
            rough.read()
            rough.stock = b""
            bench.wires.tick(step)
            other.send(b"sync()\n")
            n += 1
    other.until(lambda: sum(source[2] == other.socket.getsockname() for source in bench.robot.scripts) == n)
    mine = [text for text, _, address in bench.robot.scripts if address == other.socket.getsockname()]
    assert mine == ["sync()\n"] * n
    size = 1220 if number == 30003 else 52
    other.until(lambda: len(other.stock) == n * size)
