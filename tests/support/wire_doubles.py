"""Doubles behind the ports, and a hand-driven client in front of them."""

import socket
import struct
from contextlib import suppress

import msgspec

from sim_twin.controller.wire import (
    ControllerVersion,
    DashboardStatus,
    FieldType,
    GripperMeasurement,
    GripperRequest,
    Outcome,
    output_fields,
)
from sim_twin.controller.wire.primary_state import PrimaryState, RobotModeData
from sim_twin.controller.wire.realtime import RealtimeState

HOST = "127.0.3.1"
N_POLLS = 20_000


class Client:
    """A blocking-free client: every wait polls the server, so that a test never sleeps."""

    def __init__(self, port, poll, n_receive_bytes=None):
        self._poll = poll
        self.socket = socket.socket()
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if n_receive_bytes:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, n_receive_bytes)
        try:
            self.socket.connect((HOST, port))
        except OSError:
            self.socket.close()
            raise
        self.socket.setblocking(False)
        self.stock = b""
        self.is_ended = False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, data):
        """Send all of it, polling while the kernel is full; a peer that hung up is not an error."""
        rest = memoryview(data)
        for _ in range(N_POLLS):
            if not rest:
                return
            try:
                rest = rest[self.socket.send(rest) :]
            except BlockingIOError:
                self._poll()
            except OSError:
                return
        raise AssertionError("the server did not take what was sent")

    def read(self):
        """Take what has arrived."""
        with suppress(BlockingIOError):
            while chunk := self._receive():
                self.stock += chunk

    def _receive(self):
        try:
            chunk = self.socket.recv(65536)
        except ConnectionError:
            chunk = b""
        self.is_ended = self.is_ended or not chunk
        return chunk

    def until(self, is_true, n_polls=N_POLLS):
        """Poll and read until something holds."""
        for _ in range(n_polls):
            self.read()
            if is_true():
                return
            self._poll()
        raise AssertionError(f"it did not become true within {n_polls} polls; received {self.stock[-200:]!r}")

    def take(self, n):
        self.until(lambda: len(self.stock) >= n)
        taken, self.stock = self.stock[:n], self.stock[n:]
        return taken

    def line(self):
        self.until(lambda: b"\n" in self.stock)
        line, self.stock = self.stock.split(b"\n", 1)
        return line.decode()

    def ask(self, line):
        self.send(f"{line}\n".encode())
        return self.line()

    def ended(self):
        self.until(lambda: self.is_ended)
        return True

    def silent(self, n_polls=5):
        for _ in range(n_polls):
            self._poll()
            self.read()
        return not self.stock

    # RTDE
    def frame(self):
        """Return the next RTDE message as (letter, payload)."""
        size, kind = struct.unpack(">HB", self.take(3))
        return chr(kind), self.take(size - 3)

    def say(self, letter, payload=b""):
        self.send(struct.pack(">HB", 3 + len(payload), ord(letter)) + payload)

    def rtde(self, letter, payload=b""):
        self.say(letter, payload)
        answer, reply = self.frame()
        assert answer == letter, (answer, reply)
        return reply

    def outputs(self, names, rate_hz=500.0):
        return self.rtde("O", struct.pack(">d", rate_hz) + names.encode())

    def inputs(self, names):
        return self.rtde("I", names.encode())

    # 30001
    def package(self):
        size, kind = struct.unpack(">iB", self.take(5))
        return kind, self.take(size - 5)


ZERO_BY_KIND = {kind: 0 if kind.n_items == 1 else (0,) * kind.n_items for kind in FieldType}


class Robot:
    """Everything behind the ports, with what was asked of it."""

    def __init__(self, version):
        self.version = version
        self.numbers = {name: ZERO_BY_KIND[kind] for name, kind in output_fields(version).items()}
        self.outputs = {name: (lambda name=name: self.numbers[name]) for name in self.numbers}
        self.written = []
        self.scripts, self.refused = [], []
        self.asked = []
        self.outcome = Outcome.DONE
        self.now = DashboardStatus(
            robot_mode="RUNNING",
            safety_mode="NORMAL",
            safety_status="NORMAL",
            program_state="STOPPED",
            program="/programs/wipe.urp",
            is_running=False,
        )
        self.requests = []
        self.gripper = GripperMeasurement(pos=3, pre=0, sta=0, obj=0)

    def set(self, **changes):
        self.now = msgspec.structs.replace(self.now, **changes)

    # inputs
    def writer(self, name):
        return lambda value: self.written.append((name, value))

    # scripts and states
    def refuse_script(self, why, source):
        self.refused.append((why, source.kind))

    def submit_script(self, text, source):
        self.scripts.append((text, source.kind, source.address))

    def primary_state(self):
        return PrimaryState(mode=RobotModeData(timestamp_us=7, is_power_on=True, robot_mode=7))

    def realtime_state(self):
        return RealtimeState(time_s=1.5)

    # dashboard
    def status(self):
        return self.now

    def _asked(self, *what):
        self.asked.append(what)
        return self.outcome

    def power_on(self):
        return self._asked("power_on")

    def power_off(self):
        return self._asked("power_off")

    def brake_release(self):
        return self._asked("brake_release")

    def unlock_protective_stop(self):
        return self._asked("unlock_protective_stop")

    def close_safety_popup(self):
        return self._asked("close_safety_popup")

    def restart_safety(self):
        return self._asked("restart_safety")

    def shutdown(self):
        return self._asked("shutdown")

    def play(self):
        self._asked("play")
        return lambda: self.outcome

    def stop(self):
        return self._asked("stop")

    def pause(self):
        return self._asked("pause")

    def load(self, path):
        return self._asked("load", path)

    def load_installation(self, path):
        return self._asked("load_installation", path)

    def popup(self, text):
        return self._asked("popup", text)

    def close_popup(self):
        return self._asked("close_popup")

    def add_to_log(self, text):
        return self._asked("add_to_log", text)

    def set_operational_mode(self, mode):
        return self._asked("set_operational_mode", mode)

    def clear_operational_mode(self):
        return self._asked("clear_operational_mode")

    def set_user_role(self, role):
        return self._asked("set_user_role", role)

    # gripper
    @property
    def requested(self):
        return self.requests[-1] if self.requests else GripperRequest()

    def request(self, request):
        assert isinstance(request, GripperRequest)
        self.requests.append(request)

    def measure(self):
        return self.gripper


E_SERIES = ControllerVersion(major=5, minor=11, bugfix=0, build=108249)
