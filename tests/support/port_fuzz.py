"""Malformed messages for the controller's ports, by a seed: valid ones that were cut, bent, grown, mixed; and noise."""

import copy
import socket
import struct
from multiprocessing import get_context

import numpy as np

from sim_twin.controller.script import ScriptSyntaxError, parse_program
from sim_twin.controller.wire.script_framer import ScriptFramer

__all__ = ["PORTS", "FuzzBeside", "Fuzzer"]

PORTS = {"rtde": 30004, "dashboard": 29999, "script": 30002, "gripper": 63352}
HANG_S = 20.0
MESSAGES_A_PEER = 24
N_HALF_OPEN = 6


def frame(kind, payload):
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


VALID = {
    "rtde": (
        frame("V", b"\0\2"),
        frame("V", b"\0\1"),
        frame("v", b""),
        frame("O", struct.pack(">d", 125.0) + b"timestamp,actual_q,runtime_state"),
        frame("O", b"timestamp,actual_q"),
        frame("I", b"input_int_register_40,input_double_register_40"),
        frame("I", b"input_bit_register_70,,input_int_register_0"),
        frame("S", b""),
        frame("P", b""),
        frame("U", b"\1" + struct.pack(">id", 7, 0.5)),
        frame("M", b"\5hello\1x\3"),
    ),
    "dashboard": (
        b"robotmode\n", b"safetystatus\n", b"running\n", b"PolyscopeVersion\n", b"programState\n", b"popup a b c\n",
        b"get loaded program\n", b"is in remote control\n", b"addToLog something\n", b"quit\n", b"\n",
        b"get serial number\r\n",
    ),
    "gripper": (
        b"GET POS\n", b"GET OBJ\nGET STA\n", b"SET POS 255 GTO 1\n", b"SET SPE 12 FOR 0\n", b"SET POS 100\n",
        b"GET FLT\n",
    ),
    "script": (
        b"def f():\n  x = [1, 2.5, p[0,0,0,0,0,0]]\n  if x[0] == 1:\n    textmsg(\"a\", x)\n  end\nend\n",
        b"sec g():\n  set_digital_out(1, True)\nend\n",
        b"def h(a=1, b):\n  thread t():\n    while True:\n      sync()\n    end\n  end\n  run t()\nend\n",
        b"movej([0,0,0,0,0,0], a=1.2, v=0.5)\n",
        b"set_tcp(p[0,0,0.1,0,0,0])\n",
        b"x = (1 + (2 * (3 - norm([1,2]))))\n",
    ),
}  # fmt: skip
ACTING = (
    "power", "brake", "unlock", "restart", "shutdown", "play", "stop", "pause", "load", "close safety", "set ", "clear",
)  # fmt: skip
"""Valid commands that would stop the client beside: no malformed ones."""


class Fuzzer:
    """Makes messages for one kind of port.

    Args:
        kind: one of PORTS.
        seed: of everything that is drawn.
    """

    def __init__(self, kind, seed):
        self.kind = kind
        self.rng = np.random.default_rng([seed, list(PORTS).index(kind)])
        self._framer = ScriptFramer()

    def begin_peer(self):
        self._framer = ScriptFramer()

    def message(self):
        """Return a message that no port is meant to be sent, and that commands nothing."""
        while True:
            made = self._made()
            if not self._commands(made):
                return made

    def _made(self):
        valid = VALID[self.kind]
        picked = valid[self.rng.integers(len(valid))]
        bend = (self._flip, self._cut, self._grow, self._noise, self._mix, self._lie, self._insert)
        return bend[self.rng.integers(len(bend))](picked)

    def _commands(self, made):
        if self.kind == "dashboard":
            return any(line.strip().lower().startswith(ACTING) for line in made.decode("utf-8", "replace").split("\n"))
        if self.kind == "rtde":
            return b"speed_slider" in made
        if self.kind != "script":
            return False
        return self._would_run(made)

    def _would_run(self, made):
        """Return whether a program would come of it, with what this peer said before: that takes the robot by right."""
        framer = copy.deepcopy(self._framer)
        would_run = any(map(parses, framer.feed(made)))
        if not would_run:
            self._framer = framer
        return would_run

    def _flip(self, m):
        flipped = bytearray(m)
        for i in self.rng.integers(len(m), size=1 + int(self.rng.integers(4))):
            flipped[i] ^= 1 << int(self.rng.integers(8))
        return bytes(flipped)

    def _cut(self, m):
        return m[: int(self.rng.integers(len(m)))] or b"\0"

    def _grow(self, m):
        return m.strip(b"\n") * int(self.rng.integers(2, 12)) + m[-1:]

    def _noise(self, m):
        return self.rng.bytes(int(self.rng.integers(1, 80)))

    def _mix(self, m):
        other = VALID[self.kind][self.rng.integers(len(VALID[self.kind]))]
        at = int(self.rng.integers(len(m)))
        return m[:at] + other + m[at:]

    def _lie(self, m):
        """Sizes and numbers beyond all measure."""
        if self.kind == "rtde":
            return struct.pack(">H", int(self.rng.choice([0, 1, 2, 3, 4, 1000, 65535]))) + m[2:]
        return m.replace(b"1", b"9" * int(self.rng.integers(1, 400))).replace(
            b"(", b"(" * int(self.rng.integers(1, 200))
        )

    def _insert(self, m):
        at = int(self.rng.integers(len(m)))
        return m[:at] + self.rng.bytes(int(self.rng.integers(1, 6))) + m[at:]


def parses(text):
    try:
        parse_program(text)
    except (ScriptSyntaxError, RecursionError):
        return False
    return True


def fuzz(host, kind, n, seed):
    """Send n messages and return how many were; raise where the controller hangs or is gone."""
    fuzzer, sent, half_open = Fuzzer(kind, seed), 0, []
    while sent < n:
        fuzzer.begin_peer()
        peer = socket.create_connection((host, PORTS[kind]), timeout=HANG_S)
        way = fuzzer.rng.random()
        for _ in range(min(n - sent, int(fuzzer.rng.integers(1, 2 * MESSAGES_A_PEER)))):
            try:
                peer.sendall(fuzzer.message())
            except (BrokenPipeError, ConnectionResetError):  # it was thrown out, by right
                break
            sent += 1
        if way < 0.1:
            half_open.append(peer)  # never says goodbye, never reads
            if len(half_open) > N_HALF_OPEN:
                half_open.pop(0).close()
        elif way < 0.2:
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            peer.close()  # with a reset
        else:
            drain(peer)
    for peer in half_open:
        peer.close()
    return sent


def drain(peer):
    """Say goodbye and read until the other side does: it has taken in all that was sent by then."""
    try:
        peer.shutdown(socket.SHUT_WR)
        while peer.recv(65536):
            pass
    except TimeoutError:
        raise AssertionError(f"the controller did not end a connection within {HANG_S} s") from None
    except OSError:
        pass
    finally:
        peer.close()


def _fuzz_into(connection, host, kind, n, seed):
    try:
        connection.send(fuzz(host, kind, n, seed))
    except (AssertionError, OSError) as error:
        connection.send(f"{type(error).__name__}: {error}")


class FuzzBeside:
    """Fuzzes from a process of its own while it is open; `done` tells when it is over."""

    def __init__(self, host, kind, n, seed=0):
        context = get_context("spawn")
        self._ours, theirs = context.Pipe()
        self._process = context.Process(target=_fuzz_into, args=(theirs, host, kind, n, seed), daemon=True)
        self.n_sent = None

    def __enter__(self):
        self._process.start()
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.join()

    def done(self):
        """Return whether it is over; n_sent then says how many were sent, or what went wrong."""
        if self.n_sent is None and self._ours.poll():
            self.n_sent = self._ours.recv()
        return self.n_sent is not None or not self._process.is_alive()
