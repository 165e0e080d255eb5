"""Blocks of servo ticks against a virtual controller, timed: through this project's loop, and with the client alone."""

import math
import resource
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import RawArray
from time import perf_counter, sleep, thread_time
from typing import cast

import msgspec
from rtde_control import RTDEControlInterface

from config.resolved import Resolved
from robot.hal.protocols import Clock
from robot.realtime import CpuPin
from robot.rigs import build_plant
from robot.servo_messages import Stop
from robot.servo_process import ServoServer
from robot.tick_loop import TickLoop
from robot.tick_notes import TickNotes
from robot.tick_ring import TickWriter, ring_bytes
from robot.tick_tap import BothTaps
from sim_twin.servo_lead import Lead
from sim_twin.tally import Tally

__all__ = ["LATE_S", "PERIOD_S", "Blocks"]

PERIOD_S = 0.002
LATE_S = 1.5 * PERIOD_S
SECOND_US = 1000
SWING_RAD, SWING_S = 0.02, 2.0
N_TRIES, PAUSE_S = 5, 0.2


class _Listener:
    """Implements robot.hal.protocols.Clock around an arm's: tells of each tick its period and what was not waiting.

    The latter by the wall and by the processor, which leaves out what other processes took; and whether the kernel took
    the processor away meanwhile.

    Args:
        tell: called with each tick's period, time by the wall, time by the processor, and whether it was taken away.

    Attributes:
        clock: The arm's.
        is_on: Whether it tells.
        told_s: For how long it has told, in all.
    """

    def __init__(self, tell: Callable[[float, float, float, bool], None]) -> None:
        self._tell = tell
        self._woke_s = self._told_s = self._told_cpu_s = self._begun_s = 0.0
        self._n_preempted = 0
        self.clock: Clock
        self.is_on, self.told_s = False, 0.0

    def now_ns(self) -> int:
        """Return the time of the arm."""
        return self.clock.now_ns()

    def begin(self) -> None:
        """A block's ticks begin."""
        self._n_preempted = _n_preempted()
        self.is_on, self._woke_s = True, perf_counter()
        self._begun_s = self._woke_s
        self._told_s, self._told_cpu_s = self._woke_s, thread_time()

    def end(self) -> None:
        """They are over. Idempotent."""
        if self.is_on:
            self.is_on, self.told_s = False, self.told_s + perf_counter() - self._begun_s

    def wait_tick(self) -> int:
        """Wait as the arm's clock does."""
        asleep_s, asleep_cpu_s = perf_counter(), thread_time()
        is_preempted = _n_preempted() > self._n_preempted
        n_missed = self.clock.wait_tick()
        if self.is_on:
            woke_s = perf_counter()
            self._tell(woke_s - self._woke_s, asleep_s - self._told_s, asleep_cpu_s - self._told_cpu_s, is_preempted)
            self._n_preempted, self._woke_s = _n_preempted(), woke_s
            self._told_s, self._told_cpu_s = perf_counter(), thread_time()  # telling is no part of a tick's work
        return n_missed


class _Heard:
    """The server's end of the pipe, which tells when an intent comes and when command is given up."""

    def __init__(self, pipe: Connection, listener: _Listener, when_asked: Callable[[], None]) -> None:
        self._pipe, self._listener, self._when_asked = pipe, listener, when_asked
        self._stop = msgspec.msgpack.encode(Stop())
        self.poll, self.send_bytes = pipe.poll, pipe.send_bytes

    def recv_bytes(self, maxlength: int | None = None) -> bytes:
        """Return the next request."""
        raw = self._pipe.recv_bytes(maxlength)
        if raw == self._stop:
            self._listener.end()
        self._when_asked()
        return raw


class _Pin:
    """The pin of a thread that takes command, which is when ticks begin."""

    def __init__(self, pin: CpuPin, listener: _Listener) -> None:
        self._pin, self._listener = pin, listener
        self.unpin = pin.unpin

    def pin(self) -> None:
        """Stay on the CPU, and tell of ticks."""
        self._pin.pin()
        self._listener.begin()


class _DiedError(Exception):
    """A servo process would have ended on the spot."""


def _die() -> None:
    raise _DiedError


def _control_of(address: str) -> RTDEControlInterface:
    """Return a client that has command; the registers of the one before are free when the controller has seen it go."""
    for _ in range(N_TRIES - 1):
        with suppress(RuntimeError):
            return RTDEControlInterface(address, 1.0 / PERIOD_S, RTDEControlInterface.FLAG_UPLOAD_SCRIPT)
        sleep(PAUSE_S)
    return RTDEControlInterface(address, 1.0 / PERIOD_S, RTDEControlInterface.FLAG_UPLOAD_SCRIPT)


class Blocks:
    """Runs blocks and counts what their ticks took.

    Attributes:
        period: From tick to tick through our loop.
        own_work: Of each of those ticks, what was not waiting, less the median call of the client in the block before.
        own_cpu: The same by the processor's time of this thread.
        calm_work: As own_work, of the ticks from which the kernel did not take the processor.
        intent_cpu: As own_cpu, of the ticks in which an intent begins.
        own_work_p99_s: The 99th percentile of own_work, of every second.
        bare_period: From tick to tick with the client alone.
        bare_call: What the client's servoJ took there.
        stops: Of each block of ours that ended before its time, after how long and why: a refusal of the gate, a loss.
        cpu: Where this thread ticks, with either client.
    """

    def __init__(self, *, address: str, resolved: Resolved) -> None:
        """Store. Nothing is connected to.

        Args:
            address: the controller's.
            resolved: its rig, at this address.
        """
        self.period, self.own_work, self.own_cpu = Tally(over_s=LATE_S), Tally(), Tally()
        self.calm_work, self.intent_cpu = Tally(), Tally()
        self.own_work_p99_s: list[float] = []
        self._second, self._is_beginning = Tally(limit_us=SECOND_US), False
        self.bare_period, self.bare_call = Tally(over_s=LATE_S), Tally()
        self.stops: list[str] = []
        self._call_s = 0.0
        self._listener = _Listener(self._take)
        self._address, self._resolved = address, resolved
        self._servo = resolved.arm.servo
        self._ring = RawArray("B", ring_bytes(1.0 / PERIOD_S))
        self._lead = Lead(resolved)
        self.cpu = CpuPin(resolved.rig.realtime_priority)
        self._begin_anew()

    @property
    def servo_s(self) -> float:
        """How long our loop was in command, in blocks that ended before their time, too."""
        return self._listener.told_s

    def run_bare(self, duration_s: float) -> None:
        """Swing the base with the client's calls alone; a receive interface is open as it is in our blocks."""
        self.cpu.unpin()
        arm = self._plant.arm
        arm.connect()
        control = _control_of(self._address)
        q, servo, calls = list(arm.read().q_rad), self._servo, Tally()
        middle_rad = q[0]
        self.cpu.pin()
        begun_s = woke_s = perf_counter()
        while woke_s - begun_s < duration_s:
            start = control.initPeriod()
            q[0] = middle_rad + SWING_RAD * math.sin(2.0 * math.pi * (woke_s - begun_s) / SWING_S)
            called_s = perf_counter()
            control.servoJ(q, 0.0, 0.0, PERIOD_S, servo.lookahead_s, servo.gain)
            call_s = perf_counter() - called_s
            control.waitPeriod(start)
            now_s = perf_counter()
            self.bare_period.add(now_s - woke_s)
            self.bare_call.add(call_s)
            calls.add(call_s)
            woke_s = now_s
        self._call_s = calls.percentile_s(50.0)
        control.servoStop()
        control.stopScript()

    def run_ours(self, duration_s: float) -> None:
        """Lead the tool round a circle by what a servo process runs: pipe, motion, cell, gate, backend and taps.

        Another process asks for it, as a station does.
        """
        self.cpu.unpin()
        before_s = self.servo_s
        self._server = self._server_of_block()
        self._lead.begin(duration_s)
        try:
            self._server.run()
        except _DiedError:
            pass  # a servo process would have ended here; why is told below
        finally:
            self._listener.end()
        why = self._lead.ended()
        if why is not None:
            self.stops.append(f"after {self.servo_s - before_s:.1f} s: {why}")
            self._loop.close()
            self._begin_anew()

    def close(self) -> None:
        """Stop and release the arm, and end who led it."""
        self._loop.close()
        self._lead.close()

    def _begin_anew(self) -> None:
        """Take what a servo process is made of: one that has lost its link is never taken again, nor one closed."""
        resolved = self._resolved
        self._plant = plant = build_plant(
            rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario, cell=resolved.cell
        )
        self._listener.clock, plant.arm.clock = plant.arm.clock, self._listener
        self._notes = TickNotes(rate_hz=plant.arm.spec.rate_hz)
        self._loop = TickLoop(
            arm=plant.arm,
            config=resolved.arm,
            scenario=resolved.scenario,
            rule_sets=resolved.rule_sets,
            rig=resolved.rig,
            profile=resolved.profile,
            when_latched=lambda verdict: self._server.latched(verdict),
            tap=BothTaps(self._notes, TickWriter(self._ring)),
        )

    def _server_of_block(self) -> ServoServer:
        """Return who serves one block; plant and loop are those of the blocks before, as in a servo process."""
        return ServoServer(
            connection=cast("Connection", _Heard(self._lead.pipe, self._listener, self._begin_intent)),
            plant=self._plant,
            loop=self._loop,
            arm=self._resolved.arm,
            pulse=RawArray("q", 1),
            halt=RawArray("q", 1),
            die=_die,
            pin=cast("CpuPin", _Pin(self.cpu, self._listener)),
            notes=self._notes,
        )

    def _begin_intent(self) -> None:
        self._is_beginning = True

    def _take(self, period_s: float, spent_s: float, cpu_s: float, is_preempted: bool) -> None:
        self.period.add(period_s)
        self.own_work.add(spent_s - self._call_s)
        self.own_cpu.add(cpu_s - self._call_s)
        self._second.add(spent_s - self._call_s)
        if self._second.n * PERIOD_S >= 1.0:
            self.own_work_p99_s.append(self._second.percentile_s(99.0))
            self._second = Tally(limit_us=SECOND_US)
        if not is_preempted:
            self.calm_work.add(spent_s - self._call_s)
        if self._is_beginning:
            self.intent_cpu.add(cpu_s - self._call_s)
            self._is_beginning = False


def _n_preempted() -> int:
    """Return how often the kernel took the processor from this thread (Linux)."""
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw
