"""The process that holds an arm: motion, gate and client, and nothing else. It ticks as long as it is in command.

Time steps that follow one another lie on a grid. An intent begins a little into its step, always as far, so that what a
station takes to decide bends no path; meanwhile the arm goes on to where the last intent led. Once that is older than
an intent may be, the arm is brought to rest and held there. So the controller's watchdog is fed by commands that passed
the gate, and by nothing else.

Whoever has been silent for twice as long after a time step's end was frozen, or is too slow for the arm: what it asks
for next was decided on what has passed, so it is refused and latches, as does what comes out of order or is no request.

When the pipe to its station closes it stops the arm and ends. After a loss of the arm it ends too, at once where
nothing is known of the arm any more, whatever it was about, or where a stop was not confirmed: the client library must
never get the chance to reconnect and go on by itself. What latched is told before the arm is stopped, for a stop takes
its time. Ctrl-C at the terminal is the station's to decide on: this process is in a group of its own, so that it does
not vanish from under an epoch that is to be finished.
"""

import os
import signal
import sys
from collections.abc import Callable, MutableSequence, Sequence
from functools import partial
from multiprocessing.connection import Connection
from operator import setitem
from time import monotonic_ns

import msgspec

from config.arm import ArmConfig
from config.resolved import Resolved
from robot.errors import RobotError, SafetyError, WireError
from robot.hal.protocols import Linked, Plant
from robot.messages import ArmState, GripCommand, Verdict
from robot.realtime import CpuPin, collect_rarely
from robot.rigs import build_plant
from robot.safety import Reason
from robot.servo_messages import (
    BeginEpoch,
    Close,
    Connect,
    Connected,
    Done,
    Engage,
    Failure,
    Measure,
    Outputs,
    Reply,
    Request,
    Seed,
    Seeded,
    Stop,
    StrideReply,
    StrideRequest,
    unpack_intent,
)
from robot.stdio import STDERR, STDOUT
from robot.tick_loop import TickLoop
from robot.tick_notes import TickNote, TickNotes
from robot.tick_ring import TickWriter
from robot.tick_tap import BothTaps, TickTap

__all__ = ["ServoServer", "serve"]

BEGIN_S = 0.01
"""How far into a time step its intent begins, at most half of it: as long as a station may take to decide. One that
takes longer shifts a corner by the tool's speed times the rest."""
SILENT_AGES = 2
"""How often an intent's greatest age a station may be silent after a time step's end before it is believed no more."""
IDLE_S = 0.002
"""How long a process that is not in command waits for a request at a time."""
MOST_BYTES = 65_536
"""A request has some hundred: what says that it is longer is none, and nothing after it can be told apart."""
LOST = Reason.STALE_STATE.value
"""Nothing is known of the arm: nothing more may be said to its client."""
ENDING_REASONS = (LOST, Reason.ARM_REFUSED.value, Reason.WIRE.value)
"""After these the process ends."""
LOST_CODE = 3
STOPPED = "somebody said stop over the bus"
NOT_STOPPED = (
    "stop: expected the arm at rest and its program ended, nobody confirms it; its servo process has ended, look at "
    "the arm and at its pendant"
)
EXIT_TERMINATED = 143
NOT_TICKING = 0


def serve(
    connection: Connection,
    resolved_json: bytes,
    pulse: MutableSequence[int],
    halt: MutableSequence[int],
    uploaded: MutableSequence[int],
    ticks: MutableSequence[int],
) -> None:
    """Run a servo process until its station lets go of it.

    Args:
        connection: the pipe to the station.
        resolved_json: everything the rig is made of.
        pulse: shared memory of one number: ticks so far while it ticks, otherwise 0.
        halt: shared memory of one number: other than 0 once somebody said stop.
        uploaded: shared memory of one number: 1 from before anything of this process's may run on the arm.
        ticks: shared memory that the last half minute of ticks lies in, for whoever records.

    SIGTERM stops the arm and ends it too. It does not return: ruckig's binding would tell of some thirty leaks at the
    interpreter's end, over what a person is to read.
    """
    os.dup2(STDERR, STDOUT)  # ur_rtde tells of reconnections, placo of the model that it loads
    os.setpgrp()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(EXIT_TERMINATED))
    resolved = msgspec.json.decode(resolved_json, type=Resolved)
    pin = CpuPin(resolved.rig.realtime_priority)
    if pin.why_not is not None:
        print(f"servo process: {pin.why_not}", file=sys.stderr, flush=True)  # noqa: T201 - for a person
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario, cell=resolved.cell)
    server: ServoServer

    def die() -> None:
        if isinstance(plant, Linked):
            plant.abandon()
        os._exit(LOST_CODE)

    if isinstance(plant, Linked):
        plant.end_by(die)
        plant.tell_upload(partial(setitem, uploaded, 0, 1))
        plant.heed(lambda: bool(halt[0]))

    notes = TickNotes(rate_hz=plant.arm.spec.rate_hz)
    tap = BothTaps(notes, TickWriter(ticks))
    loop = _loop_of(resolved, plant, when_latched=lambda verdict: server.latched(verdict), tap=tap)
    server = ServoServer(
        connection=connection,
        plant=plant,
        loop=loop,
        arm=resolved.arm,
        pulse=pulse,
        halt=halt,
        die=die,
        pin=pin,
        notes=notes,
    )
    collect_rarely()
    code = 0
    try:
        server.run()
    except (EOFError, OSError, KeyboardInterrupt):
        pass  # the station is gone; the arm is stopped below
    except SystemExit:
        code = EXIT_TERMINATED
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        pulse[0] = NOT_TICKING  # stopping takes longer than a process may go without a tick while it ticks
        connection.close()  # first: the station is to know at once that nobody answers any more
        loop.close()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _loop_of(resolved: Resolved, plant: Plant, *, when_latched: Callable[[Verdict], object], tap: TickTap) -> TickLoop:
    return TickLoop(
        arm=plant.arm, config=resolved.arm, scenario=resolved.scenario, rule_sets=resolved.rule_sets, rig=resolved.rig,
        profile=resolved.profile, when_latched=when_latched, tap=tap,
    )  # fmt: skip


class ServoServer:
    """Answers one station's requests, and ticks in between.

    Args:
        connection: the pipe to the station.
        plant: what is driven.
        loop: its loop, which tells `latched`.
        arm: the arm's file.
        pulse: shared memory of one number: ticks so far while it ticks, otherwise 0.
        halt: shared memory of one number: other than 0 once somebody said stop, past the pipe and whoever commands.
        die: ends the process on the spot.
        pin: keeps this thread on a CPU of its own while it is in command.
        notes: of the loop's ticks, told with each time step.
        host_ns: the host's monotonic time, by which a station is silent; the arm's own says how old an intent is.
    """

    def __init__(
        self,
        *,
        connection: Connection,
        plant: Plant,
        loop: TickLoop,
        arm: ArmConfig,
        pulse: MutableSequence[int],
        halt: Sequence[int] = (0,),
        die: Callable[[], object],
        pin: CpuPin,
        notes: TickNotes | None = None,
        host_ns: Callable[[], int] = monotonic_ns,
    ) -> None:
        self._cpu, self._host_ns, self._notes = pin, host_ns, notes
        self._connection, self._plant, self._loop, self._tool = connection, plant, loop, arm.tool
        self._silent_ns = SILENT_AGES * round(arm.motion.intent_max_age_s * 1e9)
        self._begin_ticks = round(BEGIN_S * plant.arm.spec.rate_hz)
        self._pulse, self._halt, self._die = pulse, halt, die
        self._decode = msgspec.msgpack.Decoder(Request).decode
        self._encode = msgspec.msgpack.Encoder().encode
        self._is_in_command = self._is_over = self._is_beginning = False
        self._grip: GripCommand | None = None
        self._n_left = self._n_over = self._n_ticks = self._sequence = 0
        self._answered_ns: int | None = None
        """When the last time step ended, host's time; None where there was none since the arm was seeded."""

    def run(self) -> None:
        """Serve until closed, or until the arm was lost."""
        while not self._is_over:
            is_ticking = self._is_in_command and self._grip is not None
            if is_ticking:
                self._tick()
            while not self._is_over and self._connection.poll(0.0 if is_ticking else IDLE_S):
                self._take(self._connection.recv_bytes(MOST_BYTES))
                is_ticking = True

    def latched(self, verdict: Verdict) -> None:
        """Tell the station before the arm is stopped. Between time steps it finds the word when it asks for one."""
        self._pulse[0] = NOT_TICKING
        is_begun, self._n_left = self._n_left > 0, 0
        self._is_in_command = False
        stride = self._loop.report(verdict, is_begun=is_begun)
        self._send(StrideReply(stride=stride, is_asked=is_begun or self._is_beginning, notes=self._noted()))
        if verdict.reason == LOST:
            self._die()
        self._is_over = verdict.reason in ENDING_REASONS

    def _noted(self) -> tuple[TickNote, ...]:
        return () if self._notes is None else self._notes.take()

    def _take(self, raw: bytes) -> None:
        """Answer what came; what is no request latches where there is anything to latch."""
        try:
            request = self._decode(raw)
        except (ValueError, RecursionError) as error:
            detail = f"expected a request, came {len(raw)} bytes that are none: {error}"
            if self._is_in_command:
                self._loop.latch(Reason.MALFORMED, detail)
                self._end_unless_stopped()
            else:
                self._send(Failure(kind=WireError.__name__, message=detail))
            return
        self._answer(request)

    def _tick(self) -> None:
        assert self._grip is not None, "seeding sets it"
        if self._halt[0]:
            self._loop.latch(Reason.STOP, STOPPED)
            self._end_unless_stopped()
            return
        verdict = self._loop.tick(self._grip)
        if verdict is not None:
            self._end_unless_stopped()
            return
        self._n_ticks += 1
        self._pulse[0] = self._n_ticks
        if self._n_left:
            self._n_left -= 1
            if not self._n_left:
                self._n_over, self._answered_ns = 0, self._host_ns()
                self._send(StrideReply(stride=self._loop.report(None, is_begun=True), notes=self._noted()))
        else:
            self._n_over += 1

    def _answer(self, request: Request) -> None:
        if isinstance(request, StrideRequest):
            self._begin_stride(request)
            return
        self._pulse[0] = NOT_TICKING
        try:
            reply = self._obey(request)
        except RobotError as error:
            is_end = isinstance(error, WireError) and not isinstance(error, SafetyError)
            reply = Failure(kind=type(error).__name__, message=str(error), is_end=is_end)
        self._send(reply)
        if isinstance(reply, Failure) and reply.is_end:
            self._die()

    def _begin_stride(self, request: StrideRequest) -> None:
        n_ticks, asked_ns, heard_ns = request.n_ticks, self._now_ns(), self._host_ns()
        if self._loop.is_resting:
            self._n_over = 0
        while self._is_in_command and self._n_over < min(self._begin_ticks, n_ticks // 2):
            self._tick()
        if not self._is_in_command:
            self._send(Failure(kind=SafetyError.__name__, message="expected an engaged arm; engage and seed it first"))
            return
        self._grip = request.grip
        n_left = max(n_ticks - self._n_over, n_ticks - n_ticks // 2)
        self._is_beginning = True
        verdict = self._untimely(request.sequence, heard_ns) or self._loop.begin(
            unpack_intent(request.intent), n_ticks=n_ticks, wait_at_m=request.wait_at_m, around=request.around,
            n_left=n_left, asked_ns=asked_ns,
        )  # fmt: skip
        self._is_beginning = False
        if verdict is None:
            self._n_left = n_left
        else:
            self._end_unless_stopped()

    def _untimely(self, sequence: int, heard_ns: int) -> Verdict | None:
        """Latch for what is out of order, or comes after a silence; None where it is neither."""
        expected, self._sequence = self._sequence + 1, sequence
        if sequence != expected:
            return self._loop.latch(Reason.SEQUENCE, f"expected time step {expected}, came {sequence}")
        silent_ns = 0 if self._answered_ns is None else heard_ns - self._answered_ns
        if silent_ns <= self._silent_ns:
            return None
        return self._loop.latch(
            Reason.STALE_INTENT,
            f"expected the next intent within {self._silent_ns / 1e6:.0f} ms of a time step's end, it came after "
            f"{silent_ns / 1e6:.0f} ms: whoever commands was frozen, or is too slow",
        )

    def _end_unless_stopped(self) -> None:
        """End at once after a latch whose stop was not confirmed."""
        if not self._loop.is_stop_confirmed:
            self._die()

    def _obey(self, request: Request) -> Reply:
        match request:
            case Connect():
                self._cpu.unpin()
                self._loop.connect()
                return Connected(identity=self._plant.identity)
            case Engage():
                self._cpu.unpin()
                self._heed()
                self._loop.engage()
                if self._halt[0]:
                    self._stop()
                self._heed()
            case Seed():
                return Seeded(state=self._seed())
            case Measure():
                return Seeded(state=self._loop.measure())
            case BeginEpoch(epoch=epoch):
                return Outputs(bits=self._loop.begin_epoch(epoch))
            case Stop():
                self._stop()
            case Close():
                self._is_over = True
            case StrideRequest():
                raise AssertionError("answered elsewhere")
        return Done()

    def _heed(self) -> None:
        """Take no arm that somebody said stop to. Raises SafetyError."""
        if self._halt[0]:
            raise SafetyError(STOPPED)

    def _stop(self) -> None:
        """Stop the arm and give up command. Raises WireError, which ends the process, where nobody confirms it."""
        self._is_in_command = False
        if not self._plant.arm.stop():
            raise WireError(NOT_STOPPED)

    def _seed(self) -> ArmState:
        self._sequence, self._answered_ns = 0, None
        state = self._loop.seed()
        opening_m = min(max(state.grip.opening_m, 0.0), self._tool.stroke_m)
        self._grip = GripCommand(
            opening_m=opening_m, force_n=self._tool.grip_force_n, speed_m_s=self._tool.speed_m_s[0]
        )
        self._loop.rest()
        self._cpu.pin()
        self._is_in_command = True
        return state

    def _now_ns(self) -> int:
        return self._plant.arm.clock.now_ns()

    def _send(self, reply: Reply) -> None:
        self._connection.send_bytes(self._encode(reply))
