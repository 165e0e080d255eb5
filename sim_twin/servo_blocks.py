"""Blocks of servo ticks against a virtual controller, timed: through this project's loop, and with the client alone."""

import math
import resource
from collections.abc import Callable
from contextlib import suppress
from time import perf_counter, sleep, thread_time

from rtde_control import RTDEControlInterface

from config.resolved import Resolved
from robot.errors import RobotError
from robot.hal.protocols import Clock
from robot.hal.rtde import RtdeArm
from robot.messages import GripCommand, Heading
from robot.realtime import Seat
from robot.tick_loop import TickLoop
from sim_twin.tally import Tally

__all__ = ["LATE_S", "PERIOD_S", "Blocks"]

PERIOD_S = 0.002
LATE_S = 1.5 * PERIOD_S
INTENT_TICKS, TURN_RAD, STEP_M, HEIGHT_M = 25, 0.3, 0.01, 0.2
"""A new intent every 50 ms, each turned from the one before: the tool goes round a circle of 7 cm."""
SECOND_US = 1000
SWING_RAD, SWING_S = 0.02, 2.0
N_TRIES, PAUSE_S = 5, 0.2


class _Listener:
    """Implements robot.hal.protocols.Clock around an arm's: tells of each tick its period and what was not waiting.

    The latter by the wall and by the processor, which leaves out what other processes took; and whether the kernel took
    the processor away meanwhile.

    Attributes:
        is_on: Whether it tells.
    """

    def __init__(self, clock: Clock, tell: Callable[[float, float, float, bool], None]) -> None:
        self._clock, self._tell = clock, tell
        self._woke_s = self._told_s = self._told_cpu_s = 0.0
        self._n_preempted = 0
        self.is_on = False

    def now_ns(self) -> int:
        """Return the time of the arm."""
        return self._clock.now_ns()

    def begin(self) -> None:
        """A block begins."""
        self._n_preempted = _n_preempted()
        self.is_on, self._woke_s = True, perf_counter()
        self._told_s, self._told_cpu_s = self._woke_s, thread_time()

    def wait_tick(self) -> int:
        """Wait as the arm's clock does."""
        asleep_s, asleep_cpu_s = perf_counter(), thread_time()
        is_preempted = _n_preempted() > self._n_preempted
        n_missed = self._clock.wait_tick()
        if self.is_on:
            woke_s = perf_counter()
            self._tell(woke_s - self._woke_s, asleep_s - self._told_s, asleep_cpu_s - self._told_cpu_s, is_preempted)
            self._n_preempted, self._woke_s = _n_preempted(), woke_s
            self._told_s, self._told_cpu_s = perf_counter(), thread_time()  # telling is no part of a tick's work
        return n_missed


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
        n_stops: Blocks of ours that ended before their time, by a refusal of the gate or a loss of the arm.
        servo_s: How long our loop was in command.
        seat: Where this thread ticks, with either client.
    """

    def __init__(self, *, address: str, resolved: Resolved) -> None:
        """Store. Nothing is connected to.

        Args:
            address: the controller's.
            resolved: its rig.
        """
        self.period, self.own_work, self.own_cpu = Tally(over_s=LATE_S), Tally(), Tally()
        self.calm_work, self.intent_cpu = Tally(), Tally()
        self.own_work_p99_s: list[float] = []
        self._second, self._is_beginning = Tally(limit_us=SECOND_US), False
        self.bare_period, self.bare_call = Tally(over_s=LATE_S), Tally()
        self.n_stops, self.servo_s = 0, 0.0
        self._address, self._resolved = address, resolved
        self._servo, self._tool = resolved.arm.servo, resolved.arm.tool
        self.seat = Seat(resolved.rig.realtime_priority)
        self._call_s = 0.0
        self._begin_anew()

    def run_bare(self, duration_s: float) -> None:
        """Swing the base with the client's calls alone; a receive interface is open as it is in our blocks."""
        self.seat.leave()
        self._arm.connect()
        control = _control_of(self._arm.address)
        q, servo, calls = list(self._arm.read().q_rad), self._servo, Tally()
        middle_rad = q[0]
        self.seat.take()
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
        """Lead the tool round a circle through motion, cell, gate and backend, as a servo process does."""
        self.seat.leave()
        try:
            self._loop.connect()
            self._loop.begin_epoch(0)
            self._loop.engage()
            self.seat.take()
            is_whole = self._go_round(duration_s)
        except RobotError:
            is_whole = False
        self._listener.is_on = False
        self._arm.stop()
        if not is_whole:
            self.n_stops += 1
            self.close()
            self._begin_anew()

    def close(self) -> None:
        """Stop and release the arm."""
        self._loop.close()

    def _begin_anew(self) -> None:
        """Take another arm object: one that has lost its link is never taken again, and here its process goes on."""
        resolved = self._resolved
        self._arm = arm = RtdeArm(arm=resolved.arm, address=self._address)
        self._listener = _Listener(arm.clock, self._take)
        arm.clock = self._listener
        self._loop = TickLoop(
            arm=arm,
            config=resolved.arm,
            scenario=resolved.scenario,
            rule_sets=resolved.rule_sets,
            rig=resolved.rig,
            profile=resolved.profile,
        )

    def _go_round(self, duration_s: float) -> bool:
        """Tick for so long. Returns whether nothing was refused."""
        opening_m = min(max(self._loop.seed().grip.opening_m, 0.0), self._tool.stroke_m)
        grip = GripCommand(opening_m=opening_m, force_n=self._tool.grip_force_n, speed_m_s=self._tool.speed_m_s[0])
        heading_rad, begun_s = 0.0, perf_counter()
        self._listener.begin()
        while (gone_s := perf_counter() - begun_s) < duration_s:
            heading_rad += TURN_RAD
            self._is_beginning = True
            intent = Heading(heading_rad=heading_rad, distance_m=STEP_M, height_m=HEIGHT_M)
            stride = self._loop.stride(intent, grip, n_ticks=INTENT_TICKS)
            if stride.verdict is not None:
                return False
        self.servo_s += gone_s
        return True

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
