"""A station's end of its servo process: starts it, asks it, watches it, and ends it when it hangs."""

import os
import signal
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import TypeVar

import msgspec

from config.resolved import Resolved
from robot import errors
from robot.errors import NotEngagedError, RobotError, StaleStateError, WireError
from robot.messages import ArmState, GripCommand, Intent, Outcome, PlantIdentity, Verdict
from robot.safety import Reason
from robot.servo_messages import (
    BeginEpoch,
    Close,
    Connect,
    Connected,
    Done,
    Engage,
    Failure,
    Outputs,
    Reply,
    Request,
    Seed,
    Seeded,
    Stop,
    StrideReply,
    StrideRequest,
)
from robot.servo_process import serve
from robot.tick_loop import Stride

__all__ = ["ServoClient"]

START_S, ENGAGE_S, ANSWER_S = 60.0, 20.0, 5.0
STRIDE_SLACK_S = 5.0
"""How much later than it should a time step may end before the process counts as hung: a refusal stops the arm."""
CLOSE_S = 5.0


R = TypeVar("R", Connected, Seeded, Outputs, StrideReply, Done)


class ServoClient:
    """What a station knows as its loop (robot.tick_loop.TickLoop), in a process of its own.

    A process that hangs or has lost its arm is never asked again: it is killed, the arm's own watchdog stops the arm,
    and a new one starts, disarmed, when somebody connects and engages again.

    Attributes:
        identity: Which plant the process found; None before connect().
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
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._is_answer_due = False
        """A question was asked whose answer nobody has taken."""
        self._is_in_command = False
        self._newest: ArmState | None = None
        self._encode = msgspec.msgpack.Encoder().encode
        self._decode = msgspec.msgpack.Decoder(Reply).decode
        self.identity: PlantIdentity | None = None
        self.is_in_contact = False

    @property
    def is_lost(self) -> bool:
        """Whether command was taken, and the process has ended since of itself."""
        return self._is_in_command and self._is_gone

    @property
    def _is_gone(self) -> bool:
        """Whether there is no process, or one that has let go of its end of the pipe."""
        connection, process = self._connection, self._process
        if connection is None or process is None or not process.is_alive():
            return True
        return not self._is_answer_due and connection.poll(0.0)  # unasked, nothing comes but the pipe's end

    @property
    def pid(self) -> int | None:
        """The process's number, None while there is none."""
        return None if self._process is None else self._process.pid

    def connect(self) -> None:
        """Start the process, where none runs, and let it acquire the arm. Moves nothing.

        Raises:
            RobotError: the arm could not be acquired; the process has ended again.
        """
        if not self._is_gone:
            return
        self._await_end()
        ours, theirs = get_context("spawn").Pipe()
        process = get_context("spawn").Process(target=serve, args=(theirs, self._resolved_json), daemon=True)
        process.start()
        theirs.close()
        self._process, self._connection = process, ours
        self._is_answer_due = self._is_in_command = False
        try:
            self.identity = self._ask(Connect(), Connected, START_S).identity
        except RobotError:
            self._kill()
            raise

    def engage(self) -> None:
        """Take command of the arm; a process that has ended is started anew."""
        self.connect()
        self._ask(Engage(), Done, ENGAGE_S)
        self._is_in_command = True

    def stop(self) -> None:
        """Stop the arm and give up command; where the process is gone, it has done so already."""
        self._is_in_command = False
        if self._connection is not None:
            self._ask(Stop(), Done, ANSWER_S)

    def begin_epoch(self, epoch: int) -> int:
        """Take up the rules of an epoch and return the outputs it begins with."""
        self.connect()
        return self._ask(BeginEpoch(epoch=epoch), Outputs, ANSWER_S).bits

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it."""
        self.is_in_contact = False
        self._newest = self._ask(Seed(), Seeded, ANSWER_S).state
        return self._newest

    def stride(self, intent: Intent, grip: GripCommand, *, n_ticks: int, is_hand_busy: bool) -> Stride:
        """Carry out an intent for so many ticks. A process that hangs or has ended is gone then: the verdict says so.

        Raises:
            NotEngagedError: there was none already, or nobody has seeded it.
        """
        request = StrideRequest(intent=intent, grip=grip, n_ticks=n_ticks, is_hand_busy=is_hand_busy)
        if self._connection is None or self._newest is None:
            raise NotEngagedError("servo process: expected one that holds the arm; connect, engage and seed it")
        try:
            stride = self._ask(request, StrideReply, n_ticks * self._tick_s + STRIDE_SLACK_S).stride
        except WireError as error:
            return _cut_short(self._newest, str(error))
        self._newest, self.is_in_contact = stride.after, stride.is_in_contact
        return stride

    def close(self) -> None:
        """Stop, release and end the process. Idempotent, never raises."""
        try:
            self._end()
        finally:
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
                connection.close()  # a person broke in on a question: who finds the pipe closed stops the arm and ends
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
        if self._connection is None:
            raise NotEngagedError("servo process: expected one that runs, it has ended; connect and engage again")
        try:
            self._is_answer_due = True
            self._connection.send_bytes(self._encode(request))
            is_answered = self._connection.poll(timeout_s)
            raw = self._connection.recv_bytes() if is_answered else b""
            self._is_answer_due = False
        except (EOFError, OSError) as error:
            self._await_end()
            raise WireError(
                f"servo process: expected an answer, it has ended ({error}); the arm was stopped"
            ) from error
        if not is_answered:
            self._kill()
            raise StaleStateError(
                f"servo process: expected an answer to {type(request).__name__} within {timeout_s:g} s, none came; it "
                "was killed, the arm's own watchdog stops the arm"
            )
        reply = self._decode(raw)
        if isinstance(reply, Failure):
            raise _error(reply)
        assert isinstance(reply, expected), f"{type(request).__name__} was answered by {type(reply).__name__}"
        return reply

    def _await_end(self) -> None:
        """Let a process that nobody asks any more stop its arm and end; kill it if that takes too long."""
        if self._process is not None:
            self._process.join(CLOSE_S)
        self._kill()

    def _kill(self) -> None:
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
        if process is not None and process.is_alive():
            os.kill(process.pid or 0, signal.SIGKILL)
            process.join(CLOSE_S)


def _cut_short(state: ArmState, why: str) -> Stride:
    """Return the time step that a process which is gone came to, as far as anybody knows: nothing."""
    verdict = Verdict(
        stamp_ns=state.stamp_ns, sequence=-1, outcome=Outcome.REFUSED, reason=Reason.STALE_STATE.value, detail=why,
        is_latched=True,
    )  # fmt: skip
    return Stride(
        before=state, after=state, is_begun=False, target_m=state.tcp_position_m, limiters=(), is_in_contact=False,
        verdict=verdict,
    )  # fmt: skip


def _error(failure: Failure) -> RobotError:
    """Return the error that the process raised, or its nearest kind."""
    kind = getattr(errors, failure.kind, WireError)
    return kind(failure.message)
