"""The script's sockets against a real server on the loopback; neither side waits on the clock."""

import math
import resource
import socket
import struct
from contextlib import contextmanager, suppress
from time import process_time

import pytest

from sim_twin.controller.script import Status
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.script.builtins.sockets import N_CONNECTIONS
from tests.support.scripts import SLICE_S, ScriptRun, program

pytestmark = pytest.mark.realtime


@contextmanager
def session(body):
    """Yield a running script whose `port` is ours, and the server that listens there."""
    sockets = Sockets(slice_s=SLICE_S)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(10)
        port = server.getsockname()[1]
        try:
            yield ScriptRun(program(body), variables={"port": port}, **sockets.builtins), server
        finally:
            sockets.close()


def connected(run, server):
    """Step until the script has connected, and return our end."""
    run.step(5)
    peer, _ = server.accept()
    peer.settimeout(10)
    return peer


OPEN = 'note(socket_open("127.0.0.1", port))\n'


def test_what_is_sent_arrives_as_it_should():
    body = OPEN + 'socket_send_string("ab")\nsocket_send_line(1.5)\nsocket_send_int(-2)\nsocket_send_byte(255)\nsync()'
    with session(body) as (run, server), connected(run, server) as peer:
        run.step(3)
        expected = b"ab1.5\n" + struct.pack(">i", -2) + b"\xff"
        assert peer.recv(len(expected), socket.MSG_WAITALL) == expected
        assert run.notes == [True]


@pytest.mark.parametrize(
    ("read", "sent", "expected"),
    [
        ("socket_read_binary_integer(2)", struct.pack(">2i", 7, -8), [2, 7, -8]),
        ("socket_read_byte_list(3)", b"\x00\x01\xff", [3, 0, 1, 255]),
        ("socket_read_ascii_float(3)", b"noise (1.5, -2, 3e1) more", [3, 1.5, -2.0, 30.0]),
        ("socket_read_ascii_float(2)", b"(1)", [1, 1.0, math.nan]),
        ("socket_read_line()", b"one\r\ntwo\n", "one"),
        ("socket_read_string()", b"hello", "hello"),
        ('socket_read_string(prefix=">", suffix="<")', b"xx>in<yy", "in"),
        ('socket_read_string(prefix=">", suffix="\\n", interpret_escape=True)', b">in\n", "in"),
        ('socket_get_var("speed")', b"speed 42\n", 42),
        *[('socket_get_var("v")', f"v {n}\n".encode(), n) for n in (2**31 - 1, -(2**31), -7)],
        *[('socket_get_var("v")', f"v {n}\n".encode(), 0) for n in (2**31, -(2**31) - 1, 99999999999, "9" * 1000)],
        *[
            ('socket_get_var("v")', f"v {word}\n".encode("latin-1"), 0)
            for word in ("--5", "5-", "-", "+5", "1.5", "\xb2")
        ],
    ],
)
def test_what_arrives_is_read_as_it_should(read, sent, expected):
    with session(f"{OPEN}note({read})") as (run, server), connected(run, server) as peer:
        assert run.notes == [True]
        peer.sendall(sent)
        run.finish(1500)
        assert run.interpreter.status is Status.FINISHED
        assert str(run.notes[1]) == str(expected)  # nan equals nan as text


@pytest.mark.parametrize(
    ("read", "expected"),
    [
        ("socket_read_binary_integer(2, timeout=0.02)", [0, -1, -1]),
        ("socket_read_byte_list(1, timeout=0.02)", [0, -1]),
        ("socket_read_ascii_float(2, timeout=0.02)", [0, math.nan, math.nan]),
        ("socket_read_line(timeout=0.02)", ""),
        ("socket_read_string(timeout=0.02)", ""),
    ],
)
def test_a_timeout_is_counted_in_slices(read, expected):
    with session(f"{OPEN}sync()\nnote(0)\nnote({read})") as (run, server), connected(run, server):
        run.finish()
        (before, _), (after, value) = run.by_slice[1:]
        assert after - before == 10
        assert str(value) == str(expected)


def test_a_read_in_parts_waits_for_the_whole():
    with session(f"{OPEN}note(socket_read_binary_integer(1))") as (run, server), connected(run, server) as peer:
        peer.sendall(b"\x00\x00\x01")
        run.step(5)
        assert run.notes == [True]
        peer.sendall(b"\x02")
        run.finish(1500)
        assert run.notes[1] == [1, 0x102]


def test_other_threads_run_while_one_reads():
    body = OPEN + "thread t():\n while True:\n note(1)\n sync()\n end\n end\n run t()\n socket_read_line(timeout=0.01)"
    with session(body) as (run, server), connected(run, server):
        run.finish()
        assert run.notes.count(1) >= 5


def test_nobody_listening_means_false():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    sockets = Sockets(slice_s=SLICE_S)
    run = ScriptRun(program(OPEN), variables={"port": port}, **sockets.builtins).finish(1500)
    assert run.notes == [False]


@pytest.mark.parametrize("address", ["no.such.host", "", "999.1.1.1"])
def test_an_address_that_would_have_to_be_looked_up_is_refused_at_once(address):
    sockets = Sockets(slice_s=SLICE_S)
    run = ScriptRun(program(f'note(socket_open("{address}", 1))'), **sockets.builtins).step()
    assert run.notes == [False]


def test_a_peer_that_hangs_up_ends_the_read_after_what_it_sent():
    with session(f'{OPEN}note(socket_read_line())\nnote(socket_read_line())\nnote(socket_send_line("a"))') as (
        run,
        server,
    ):
        with connected(run, server) as peer:
            peer.sendall(b"last\nhalf")
        run.finish(500)
        assert run.notes == [True, "last", "", False]


def test_sockets_have_names_and_closing_one_leaves_the_other():
    body = """
    socket_open("127.0.0.1", port, "a")
    socket_open("127.0.0.1", port, "b")
    socket_close("a")
    note(socket_send_string("x", "a"))
    note(socket_send_string("y", "b"))
    note(socket_send_string("z"))
    """
    with session(body) as (run, server), connected(run, server) as first, connected(run, server) as second:
        run.finish()
        assert run.notes == [False, True, False]
        assert first.recv(1) == b""
        assert second.recv(1) == b"y"


def test_set_var_sends_its_line():
    with session(f'{OPEN}socket_set_var("n", 3)\nsync()') as (run, server), connected(run, server) as peer:
        assert peer.recv(8, socket.MSG_WAITALL) == b"SET n 3\n"
        run.finish()


def test_reading_too_many_numbers_is_a_mistake():
    sockets = Sockets(slice_s=SLICE_S)
    run = ScriptRun(program("socket_read_binary_integer(31)"), **sockets.builtins).step()
    assert "expected to read 1 to 30 numbers, got 31" in run.interpreter.error.message


def test_a_program_has_so_many_connections_and_one_more_is_not_opened():
    body = f"""
    i = 0
    while i < {N_CONNECTIONS + 3}:
        note(socket_open("127.0.0.1", port, str_cat("s", i)))
        i = i + 1
    end
    socket_close("s0")
    note(socket_open("127.0.0.1", port, "again"))
    """
    with session(body) as (run, _):
        run.finish(1500)
        assert run.notes == [True] * N_CONNECTIONS + [False] * 3 + [True]


def test_a_process_without_a_socket_left_opens_none():
    with session(OPEN) as (run, _):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
        try:
            run.step(2)
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        assert (run.notes, run.interpreter.status) == ([False], Status.FINISHED)


def test_what_nobody_reads_waits_with_the_sender_and_is_looked_through_in_no_time():
    body = OPEN + 'note(socket_read_string(prefix="a", suffix="b", timeout=0.1))\nnote(socket_read_line(timeout=0.1))'
    with session(body) as (run, server), connected(run, server) as peer:
        peer.setblocking(False)
        for _ in range(60):
            with suppress(BlockingIOError):
                peer.send(b"a" * 65536)
            begun = process_time()
            run.step()
            # Looked for with a pattern, this took minutes.
            assert process_time() - begun < 0.1
        run.finish()
        assert run.notes == [True, "", ""]
