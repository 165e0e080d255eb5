"""A commander in a process of its own: a station of the rig virtual_lab that asks for motion to and fro.

It begins disarmed and goes on asking, refused or not. Somebody else, who stands in for a person, arms it; and may have
it misbehave.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from math import nan
from multiprocessing import get_context
from multiprocessing.connection import Connection
from time import monotonic, sleep
from types import TracebackType
from typing import Self

import msgspec

from config.resolved import Resolved
from robot.errors import RobotError
from robot.local_station import LocalStation
from robot.messages import GripCommand, StationMode, StationState, Twist
from robot.rigs import build_operator, build_station
from robot.servo_client import ServoClient
from robot.servo_messages import StrideRequest, pack_intent
from sim_twin.broken.shuttle import Shuttle
from sim_twin.processes.log import Cells, Log, new_log

__all__ = ["CommanderError", "CommanderProcess", "Order"]

START_S, ANSWER_S, END_S = 120.0, 60.0, 10.0
PAUSE_S = 0.05
SLOW_S = 0.25
"""Between a time step's end and the next intent: one in 300 ms."""
SOURCE, OTHER = "a commander", "another commander"


class Order(StrEnum):
    """What a commander may be told to do."""

    ARM = "arm"
    """Somebody looks, arms it, or clears its latch, and lays the table out."""
    STATE = "state"
    SLOW = "slow"
    NAN = "nan"
    BYTES = "bytes"
    SCHEMA = "schema"
    TORN = "torn"
    LONG = "long"
    OLD = "old"
    LEASE = "lease"
    END = "end"


class CommanderError(RuntimeError):
    """A commander did not start, or was refused the arm by the station."""


class _Commander:
    """The process's inside."""

    def __init__(self, station: LocalStation, resolved: Resolved, log: Log) -> None:
        self._station, self._rig, self._log = station, resolved.rig, log
        tool = resolved.arm.tool
        self._grip = GripCommand(opening_m=tool.stroke_m, force_n=tool.grip_force_n, speed_m_s=tool.speed_m_s[1])
        self._shuttle, self._pause_s, self._is_nan, self._epoch = Shuttle(), 0.0, False, 0
        self._lies: dict[Order, Callable[[Connection], None]] = {
            Order.BYTES: lambda pipe: pipe.send_bytes(bytes(range(256))),
            Order.SCHEMA: lambda pipe: pipe.send_bytes(
                msgspec.msgpack.encode({"type": "StrideRequest", "n_ticks": -1})
            ),
            Order.TORN: lambda pipe: _write(pipe, b"\x00\x00\x03\xe8half"),
            Order.LONG: lambda pipe: _write(pipe, b"\x7f\x00\x00\x00" + bytes(64)),
            Order.OLD: self._repeat,
        }

    def obey(self, order: Order) -> StationState | None:
        """Do as one is told; the state where that was asked for."""
        match order:
            case Order.ARM:
                self._take()
            case Order.SLOW:
                self._pause_s = SLOW_S
            case Order.NAN:
                self._is_nan = True
            case Order.LEASE:
                self._station.hand_over(OTHER)
            case Order.STATE | Order.END:
                pass
            case _:
                self._lie(self._lies[order])
        return self._station.state

    def step(self) -> None:
        """Ask for the next time step, whether anybody grants it or not."""
        sleep(self._pause_s)
        linear = (nan, 0.0, 0.0)
        intent = Twist(linear_m_s=linear) if self._is_nan else self._shuttle.intent
        self._log.ask(monotonic())
        try:
            result = self._station.step(intent)
        except RobotError:
            self._log.take_back()
            self._log.refuse(monotonic())
            sleep(PAUSE_S)
            return
        if not result.executed.duration_s:
            self._log.take_back()
        if result.is_void:
            self._log.refuse(monotonic())
            return
        self._shuttle.note(result.percept.tcp_position_m)
        self._log.carried_out(is_midway=self._shuttle.is_midway)

    def _take(self) -> None:
        operator = build_operator(self._rig)
        assert operator is not None, "virtual_lab names one"
        self._epoch += 1
        if self._station.state.mode is StationMode.LATCHED:
            operator.rearm(self._station, seed=1, epoch=self._epoch)
        elif self._station.state.mode is StationMode.DISARMED:
            operator.arm_once(self._station)
        self._station.reset(seed=1, epoch=self._epoch)
        self._shuttle, self._pause_s, self._is_nan = Shuttle(), 0.0, False
        self._log.begin(self._client.pid)

    @property
    def _client(self) -> ServoClient:
        loop = self._station.loop
        assert isinstance(loop, ServoClient), "the rig has a bus"
        return loop

    def _lie(self, lie: Callable[[Connection], None]) -> None:
        """Send past the client what no client sends."""
        pipe = self._client.pipe
        if pipe is not None:
            with suppress(OSError):
                lie(pipe)

    def _repeat(self, pipe: Connection) -> None:
        """Send an intent again whose time step was over long ago."""
        request = StrideRequest(intent=pack_intent(self._shuttle.intent), grip=self._grip, n_ticks=25, sequence=3)
        pipe.send_bytes(msgspec.msgpack.encode(request))


def _write(pipe: Connection, raw: bytes) -> None:
    os.write(pipe.fileno(), raw)


def _serve(line: Connection, cells: Cells, resolved_json: bytes) -> None:
    """Run in the process: until told to end, or whoever tells is gone."""
    resolved = msgspec.json.decode(resolved_json, type=Resolved)
    log = Log(cells)
    with suppress(EOFError, KeyboardInterrupt), build_station(resolved) as station:
        station.take_lease(SOURCE)
        commander = _Commander(station, resolved, log)
        line.send_bytes(b"")
        order = Order.STATE
        while order is not Order.END:
            while line.poll(0.0):
                order = Order(line.recv_bytes().decode())
                line.send_bytes(_answer(commander, order))
            commander.step()


def _answer(commander: _Commander, order: Order) -> bytes:
    try:
        return msgspec.json.encode(commander.obey(order))
    except RobotError as error:
        return msgspec.json.encode(f"{type(error).__name__}: {error}")


class CommanderProcess:
    """Runs a commander while it is open; it begins disarmed.

    Args:
        resolved: the rig.

    Attributes:
        log: what it leaves.
    """

    def __init__(self, resolved: Resolved) -> None:
        self._cells = new_log()
        self.log = Log(self._cells)
        context = get_context("spawn")
        self._line, theirs = context.Pipe()
        # Not a daemon: those may have no children, and its servo process is one.
        self._process = context.Process(
            target=_serve, args=(theirs, self._cells, msgspec.json.encode(resolved)), name="commander"
        )
        self._process.start()
        theirs.close()

    def __enter__(self) -> Self:
        """Wait until it asks.

        Raises:
            CommanderError: it did not start.
        """
        try:
            if self._line.poll(START_S):
                self._line.recv_bytes()
                return self
        except EOFError:
            pass
        self.close()
        raise CommanderError("commander: expected it to start, it did not")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """The process's number."""
        assert self._process.pid is not None, "it was started"
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.is_alive()

    def tell(self, order: Order) -> StationState:
        """Have it do something, and return its station's state after that.

        Raises:
            CommanderError: it does not answer, or the station refused.
        """
        try:
            self._line.send_bytes(order.encode())
            said = self._line.recv_bytes() if self._line.poll(ANSWER_S) else b'"no answer"'
        except (EOFError, OSError) as error:
            raise CommanderError(f"commander: expected an answer to {order}, it is gone") from error
        came = msgspec.json.decode(said, type=StationState | str)
        if isinstance(came, str):
            raise CommanderError(f"commander, told to {order}: {came}")
        return came

    def close(self) -> None:
        """End it, and with it its servo process. Idempotent."""
        if self._process.is_alive():
            with suppress(CommanderError):
                self.tell(Order.END)
            self._process.join(END_S)
            if self._process.is_alive():
                self._process.kill()
        self._process.join(END_S)
        self._line.close()
