"""A servo process's server that ticks when it is told to: what happens between time steps, without a wall clock."""

from collections.abc import Callable
from multiprocessing import Pipe
from time import monotonic_ns

import msgspec

from config.resolved import Resolved
from robot.hal.protocols import Plant
from robot.messages import ArmState, GripCommand, Intent, Vec3
from robot.realtime import CpuPin
from robot.servo_messages import (
    BeginEpoch,
    Connect,
    Engage,
    Outputs,
    Reply,
    Request,
    Seed,
    StrideRequest,
    pack_intent,
)
from robot.servo_process import ServoServer
from robot.tick_loop import Stride, TickLoop

__all__ = ["HandServed"]


class HandServed:
    """A server over a plant in lock-step; `seed` before the first time step.

    Args:
        resolved: the rig.
        plant: what it drives.
        host_ns: the host's time, by which a station is silent.

    Attributes:
        loop: its loop.
        server: the server.
    """

    def __init__(self, resolved: Resolved, plant: Plant, *, host_ns: Callable[[], int] = monotonic_ns) -> None:
        self.plant = plant
        self._ours, theirs = Pipe()
        tool = resolved.arm.tool
        self._grip = GripCommand(opening_m=tool.stroke_m, force_n=tool.grip_force_n, speed_m_s=tool.speed_m_s[1])
        self.loop = TickLoop(
            arm=plant.arm, config=resolved.arm, scenario=resolved.scenario, rule_sets=resolved.rule_sets,
            rig=resolved.rig, profile=resolved.profile, when_latched=lambda verdict: self.server.latched(verdict),
        )  # fmt: skip
        self.server = ServoServer(
            connection=theirs, plant=plant, loop=self.loop, arm=resolved.arm, pulse=[0], die=lambda: None,
            pin=CpuPin(0), host_ns=host_ns,
        )  # fmt: skip
        self._n_asked = 0
        self._ask(Connect())
        self._ask(Engage())

    def seed(self) -> None:
        """Start from the measured state."""
        self._n_asked = 0
        self._ask(Seed())

    def begin_epoch(self, epoch: int) -> int:
        """Take up an epoch's rules; return the outputs it begins with."""
        self.server._answer(BeginEpoch(epoch=epoch))
        (reply,) = self.replies()
        assert isinstance(reply, Outputs)
        return reply.bits

    def wait(self, n_ticks: int) -> ArmState:
        """Let so many ticks pass without a word from the station; return the newest state."""
        for _ in range(n_ticks):
            self.server._tick()
        return self.loop.state

    def request(self, intent: Intent, *, n_ticks: int, wait_at_m: Vec3 | None = None) -> StrideRequest:
        """Return the next time step's request."""
        self._n_asked += 1
        return StrideRequest(
            intent=pack_intent(intent), grip=self._grip, n_ticks=n_ticks, sequence=self._n_asked, wait_at_m=wait_at_m
        )

    def begin(self, intent: Intent, *, n_ticks: int) -> None:
        """Ask for a time step; its ticks follow by `wait`."""
        self.send(msgspec.msgpack.encode(self.request(intent, n_ticks=n_ticks)))

    def send(self, raw: bytes) -> None:
        """Let bytes come through the pipe."""
        self.server._take(raw)

    def stride(self, intent: Intent, *, n_ticks: int, n_decided: int = 0) -> Stride:
        """Carry out a time step that the station took so many ticks to decide on."""
        self.wait(n_decided)
        self.begin(intent, n_ticks=n_ticks)
        while not self._ours.poll(0.0):
            self.server._tick()
        (reply,) = self.replies()
        return reply.stride

    def replies(self) -> list[Reply]:
        """Return what the server has said since it was asked last."""
        said: list[Reply] = []
        while self._ours.poll(0.0):
            said.append(msgspec.msgpack.decode(self._ours.recv_bytes(), type=Reply))
        return said

    def _ask(self, request: Request) -> None:
        self.server._answer(request)
        self.replies()
