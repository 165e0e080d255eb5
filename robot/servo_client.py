"""A station's end of its servo process: starts it, asks it, watches it, and ends it when it hangs."""

from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from time import monotonic, sleep
from typing import TypeVar

import msgspec

from config.resolved import Resolved
from robot.errors import NotEngagedError, RobotError, StaleStateError, WireError
from robot.hal.sole_holder import SoleHolder
from robot.messages import ArmState, GripCommand, Intent, PlantIdentity, Vec3
from robot.servo_failures import cut_short, error_of
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
    pack_intent,
)
from robot.servo_process import ENDING_REASONS, serve
from robot.servo_watch import HUNG_S, ServoWatch
from robot.surroundings import Surroundings
from robot.taking import Taking, has_come
from robot.tick_loop import Stride
from robot.tick_notes import TickNote
from robot.tick_ring import TickReader, ring_bytes

__all__ = ["ServoClient"]

START_S, ENGAGE_S, ANSWER_S = 60.0, 20.0, 5.0
STRIDE_SLACK_S = 5.0
"""How much later than it should a time step may end while the process still ticks."""
CLOSE_S = 5.0
"""How long a process may take to stop its arm, where it still can, and to end."""
COAST_S = 0.5
"""Longer than the controller's watchdog waits and the arm then takes to rest."""

R = TypeVar("R", Connected, Seeded, Outputs, StrideReply, Done)


class ServoClient:
    """What a station knows as its loop (robot.tick_loop.TickLoop), in a process of its own.

    A process that hangs or has lost its arm is never asked again: it is killed, the arm's own watchdog stops the arm,
    and a new one starts, disarmed, when somebody connects and engages again.

    Attributes:
        identity: Which plant the process found; None before connect().
        ticks: What every tick measured, asked for and was told, for whoever records; of processes that ended, too.
    """

    def __init__(self, resolved: Resolved, *, when_closed: Callable[[], object] | None = None) -> None:
        """Store. The process starts with connect().

        Args:
            resolved: everything the rig is made of.
            when_closed: called once when the client is closed.
        """
        self._when_closed = when_closed
        self._resolved_json = msgspec.json.encode(resolved)
        self._tick_s = resolved.rig.tick_s
        self._taking = Taking(resolved.rig.address)
        self._sole = None if resolved.rig.address is None else SoleHolder(resolved.rig.address)
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._watch: ServoWatch | None = None
        self._context = get_context("spawn")
        self._halt = self._context.RawArray("q", 1)
        """Shared memory: a stop was asked for, whatever the pipe is busy with."""
        self._ring = self._context.RawArray("B", ring_bytes(1.0 / self._tick_s))
        self.ticks = TickReader(self._ring)
        self._is_leaving = False
        """It has said that it lost its arm, or its end of the pipe is closed."""
        self._is_answer_due = False
        """A question was asked whose answer nobody has taken."""
        self._is_in_command = False
        self._told: StrideReply | None = None
        """What latched between time steps, until somebody takes it."""
        self._is_refusal_due = False
        """It crossed a time step on the way, which will be refused."""
        self._why_lost: str | None = None
        self._rests_at_s = 0.0
        """Host's monotonic time at which an arm that was lost rests at the latest."""
        self._newest: ArmState | None = None
        self._notes: tuple[TickNote, ...] = ()
        self._n_strides = 0
        """Asked for since the arm was seeded."""
        self._epoch = 0
        """Whose rules are in force, in a process that takes over from one that has ended too."""
        self._encode = msgspec.msgpack.Encoder().encode
        self._decode = msgspec.msgpack.Decoder(Reply).decode
        self.identity: PlantIdentity | None = None
        self.is_in_contact = False

    @property
    def why_lost(self) -> str | None:
        """Why command was lost between time steps since it was taken, None where it was not."""
        self._overhear()
        if self._told is not None and self._told.stride.verdict is not None:
            verdict = self._told.stride.verdict
            return f"{verdict.reason}: {verdict.detail}"
        if self._is_in_command and self._is_gone:
            return self._how_it_ended()
        return self._why_lost

    @property
    def _is_gone(self) -> bool:
        """Whether there is no process, or one that must not be asked any more."""
        return self._process is None or self._is_leaving or not self._process.is_alive()

    @property
    def pid(self) -> int | None:
        """The process's number, None while there is none."""
        return None if self._process is None else self._process.pid

    @property
    def pipe(self) -> Connection | None:
        """What leads to the process, for whoever checks what it makes of a station gone wrong; None without one."""
        return self._connection

    def hold(self) -> None:
        """Have no other process of this machine hold the arm, from now until this client is closed.

        Raises:
            WireError: another one does.
        """
        if self._sole is not None:
            self._sole.take()

    def connect(self) -> None:
        """Start the process, where none runs, and let it acquire the arm. Moves nothing.

        Raises:
            RobotError: the arm could not be acquired; the process has ended again. Or another one of this machine
                holds it.
        """
        self._overhear()
        if not self._is_gone:
            return
        self.hold()
        self.await_rest()
        self._taking.wait()
        ours, theirs = self._context.Pipe()
        pulse = self._context.RawArray("q", 1)
        shared = (pulse, self._halt, self._taking.uploaded, self._ring)
        process = self._context.Process(target=serve, args=(theirs, self._resolved_json, *shared), daemon=True)
        process.start()
        theirs.close()
        self._process, self._connection = process, ours
        assert process.pid is not None, "it was started"
        self._watch = ServoWatch(process.pid, pulse)
        try:
            self.identity = self._ask(Connect(), Connected, START_S).identity
            self._ask(BeginEpoch(epoch=self._epoch), Outputs, ANSWER_S)
        except RobotError:
            self._kill()
            raise

    def engage(self) -> None:
        """Take command of the arm; a process that has ended is started anew, and what was lost before is forgotten."""
        self.connect()
        self._told = None
        assert self._watch is not None, "connecting sets it"
        try:
            with self._taking.watched(end=self._watch.kill, is_gone=lambda: self._is_gone) as alarm:
                self._overhear()
                self._exchange(Engage(), Done, ENGAGE_S, alarm=alarm)
        except RobotError as error:
            if self._is_gone and self._taking.uploaded[0]:
                self._note_loss(str(error))
            raise
        self._is_in_command, self._why_lost = True, None

    def stop(self) -> None:
        """Stop the arm and give up command; return once it rests, or at once where it is lost.

        A loss is told as soon as it is known: whoever needs the arm at rest waits for that himself (`await_rest`).
        """
        self._overhear()
        if not self._is_gone:
            was_in_command = self._is_in_command
            try:
                self._ask(Stop(), Done, ANSWER_S)
            except WireError as error:
                self._is_in_command = False
                if was_in_command:
                    self._note_loss(str(error))
            else:
                self._is_in_command = False
                return
        if self._process is None or not self._process.is_alive():
            self._kill()

    def halt(self) -> None:
        """Have the arm stopped and latched within a tick, from any thread, also amid a time step. Waits for nothing.

        Nobody takes the arm either, and a hand that is being activated is stopped, until `end_halt`.
        """
        self._halt[0] = 1

    def end_halt(self) -> None:
        """Let the arm be taken again: the stop was carried out, and who armed it was told."""
        self._halt[0] = 0

    def await_rest(self) -> None:
        """Wait until an arm that was lost must be at rest, by its process or its own watchdog; others rest already."""
        if self._is_gone:
            self._await_end()
            sleep(max(0.0, self._rests_at_s - monotonic()))

    def begin_epoch(self, epoch: int) -> int:
        """Take up the rules of an epoch and return the outputs it begins with."""
        self.connect()
        self._epoch = epoch
        return self._ask(BeginEpoch(epoch=epoch), Outputs, ANSWER_S).bits

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it."""
        self.is_in_contact = False
        self._n_strides = 0
        self._newest = self._ask(Seed(), Seeded, ANSWER_S).state
        return self._newest

    def measure(self) -> ArmState:
        """Read the arm, in command of it or not; a process that has ended is started anew. Moves nothing."""
        self.connect()
        return self._ask(Measure(), Seeded, ANSWER_S).state

    def stride(
        self,
        intent: Intent,
        grip: GripCommand,
        *,
        n_ticks: int,
        wait_at_m: Vec3 | None = None,
        around: Surroundings | None = None,
    ) -> Stride:
        """Carry out an intent for so many ticks. What latched since the last one is told in its place.

        A process that hangs or has ended is gone then: the verdict says so.

        Raises:
            NotEngagedError: there was none already, or nobody has seeded it.
        """
        if self._connection is None or self._newest is None:
            raise NotEngagedError("servo process: expected one that holds the arm; connect, engage and seed it")
        self._overhear()
        told, self._told = self._told, None
        try:
            if told is None:
                self._n_strides += 1
                request = StrideRequest(
                    intent=pack_intent(intent), grip=grip, n_ticks=n_ticks, sequence=self._n_strides,
                    wait_at_m=wait_at_m, around=around,
                )  # fmt: skip
                told = self._exchange(request, StrideReply, n_ticks * self._tick_s + STRIDE_SLACK_S)
        except WireError as error:
            return cut_short(self._newest, str(error))
        stride, self._notes = told.stride, told.notes
        self._is_leaving |= stride.verdict is not None and stride.verdict.reason in ENDING_REASONS
        self._newest, self.is_in_contact = stride.after, stride.is_in_contact
        return stride

    def take_notes(self) -> tuple[TickNote, ...]:
        """Return what ticks of the last time step asked for, thinned; once."""
        notes, self._notes = self._notes, ()
        return notes

    def close(self) -> None:
        """Stop, release and end the process. Idempotent, never raises."""
        try:
            self._end()
        finally:
            self._taking.wait()
            if self._sole is not None:
                self._sole.release()
            when_closed, self._when_closed = self._when_closed, None
            if when_closed is not None:
                when_closed()

    def _end(self) -> None:
        """Let the process stop the arm and end; kill it if it does not."""
        process, connection = self._process, self._connection
        if process is None or connection is None:
            return
        try:
            if self._is_answer_due:
                # A person broke in on a question: who is terminated, or finds the pipe closed, stops the arm and ends.
                process.terminate()
                connection.close()
            else:
                self._ask(Close(), Done, ANSWER_S)
        except RobotError:
            pass  # it is ended below
        self._await_end()

    def _ask(self, request: Request, expected: type[R], timeout_s: float) -> R:
        """Send a request and return its reply.

        Raises:
            RobotError: what the process raised, by its name; or it hangs, or is gone.
        """
        self._overhear()
        return self._exchange(request, expected, timeout_s)

    def _exchange(self, request: Request, expected: type[R], timeout_s: float, *, alarm: int | None = None) -> R:
        """Ask without listening first: a time step does so itself, once, and says what it heard in place of asking.

        Listening here again, as it once did, kept what was said in between for later, and asked a process that had
        latched by then: its refusal ended the run.
        """
        if self._connection is None:
            raise NotEngagedError("servo process: expected one that runs, it has ended; connect and engage again")
        if self._is_leaving:
            raise self._gone("it was asked nothing more")
        try:
            self._is_answer_due = True
            self._connection.send_bytes(self._encode(request))
            reply = self._answer(self._connection, expected, timeout_s, alarm)
            self._is_answer_due = False
        except StaleStateError:
            self._is_leaving = True
            raise  # at once: a process may take 0.5 s to be gone
        except (EOFError, OSError) as error:
            raise self._gone(str(error)) from error
        if reply is None:
            self._kill()
            raise StaleStateError(
                f"servo process: expected an answer to {type(request).__name__} within {timeout_s:g} s, none came; it "
                "was killed, the arm's own watchdog stops the arm"
            )
        if isinstance(reply, Failure):
            self._is_leaving |= reply.is_end
            raise error_of(reply)
        assert isinstance(reply, expected), f"{type(request).__name__} was answered by {type(reply).__name__}"
        return reply

    def _answer(self, connection: Connection, expected: type[R], timeout_s: float, alarm: int | None) -> Reply | None:
        """Return the next reply but what latched meanwhile, which is kept; None where none comes."""
        while has_come(connection, timeout_s, alarm):
            reply = self._decode(connection.recv_bytes())
            if isinstance(reply, Failure) and self._is_refusal_due:
                self._is_refusal_due = False
            elif isinstance(reply, Failure) and expected is StrideReply and self._told is not None:
                told, self._told = self._told, None  # it came just before the time step was asked for
                return told
            elif not isinstance(reply, StrideReply):
                return reply
            elif expected is StrideReply:
                self._is_refusal_due = not reply.is_asked
                return reply
            else:
                self._take_in(reply)
        return None

    def _gone(self, how: str) -> WireError:
        """Clear away a process that has ended or lost its arm, and return the error that says so."""
        why = f"{self._how_it_ended()} ({how})" if how else self._how_it_ended()
        was_hung = self._watch is not None and self._watch.was_hung
        self._await_end()
        return StaleStateError(why) if was_hung else WireError(why)

    def _how_it_ended(self) -> str:
        if self._watch is not None and self._watch.was_hung:
            return (
                "servo process: expected a tick every 2 ms, none came for 20 ms, or for "
                f"{1e3 * HUNG_S:.0f} ms while it could not run; it was killed, the arm's own watchdog stops the arm"
            )
        return "servo process: expected an answer, it has ended; the arm's own watchdog stops the arm"

    def _overhear(self) -> None:
        """Take in what came unasked: what latched since the last time step, or the pipe's end."""
        if self._connection is None or self._is_answer_due:
            return
        try:
            while self._connection.poll(0.0):
                reply = self._decode(self._connection.recv_bytes())
                if isinstance(reply, StrideReply):
                    self._take_in(reply)
                else:
                    self._is_refusal_due = False
        except (EOFError, OSError):
            self._is_leaving = True

    def _take_in(self, told: StrideReply) -> None:
        self._told = told
        verdict = told.stride.verdict
        self._is_leaving |= verdict is not None and verdict.reason in ENDING_REASONS

    def _await_end(self) -> None:
        """Let a process that nobody asks any more stop its arm and end; kill it if that takes too long."""
        if self._process is not None:
            self._process.join(CLOSE_S)
        self._kill()

    def _kill(self) -> None:
        if self._is_in_command:
            self._is_in_command = False
            self._note_loss(self._how_it_ended())
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        watch, self._watch = self._watch, None
        self._is_leaving = self._is_answer_due = self._is_refusal_due = False
        if watch is not None:
            watch.close()
        if connection is not None:
            connection.close()
        if process is not None:
            if process.is_alive():
                process.kill()
            process.join(CLOSE_S)

    def _note_loss(self, why: str) -> None:
        self._why_lost, self._rests_at_s = why, monotonic() + COAST_S
