"""A station's end of its servo process: starts it, asks it, watches it, and ends it when it hangs."""

from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from time import sleep
from typing import TypeVar

import msgspec

from config.resolved import Resolved
from robot import errors
from robot.errors import NotEngagedError, RobotError, StaleStateError, WireError
from robot.messages import ArmState, GripCommand, Intent, PlantIdentity
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
from robot.servo_process import ENDING_REASONS, serve
from robot.servo_watch import HUNG_S, ServoWatch
from robot.tick_loop import Stride

__all__ = ["ServoClient"]

START_S, ENGAGE_S, ANSWER_S = 60.0, 20.0, 5.0
STRIDE_SLACK_S = 5.0
"""How much later than it should a time step may end while the process still ticks."""
CLOSE_S = 5.0
LEAVE_S = 3.0
"""How long a process that has lost its arm may take to stop it, where it still can, and to end."""
COAST_S = 0.5
"""Longer than the controller's watchdog waits and the arm then takes to rest."""

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
        self._watch: ServoWatch | None = None
        self._is_leaving = False
        self._encode = msgspec.msgpack.Encoder().encode
        self._decode = msgspec.msgpack.Decoder(Reply).decode
        self.identity: PlantIdentity | None = None
        self.is_in_contact = False

    @property
    def pid(self) -> int | None:
        """The process's number, None while there is none."""
        return None if self._process is None else self._process.pid

    def connect(self) -> None:
        """Start the process, where none runs, and let it acquire the arm. Moves nothing.

        Raises:
            RobotError: the arm could not be acquired; the process has ended again.
        """
        self._reap()
        if self._process is not None:
            return
        context = get_context("spawn")
        ours, theirs = context.Pipe()
        pulse = context.RawArray("q", 1)
        process = context.Process(target=serve, args=(theirs, self._resolved_json, pulse), daemon=True)
        process.start()
        theirs.close()
        self._process, self._connection = process, ours
        assert process.pid is not None, "it was started"
        self._watch = ServoWatch(process.pid, pulse)
        try:
            self.identity = self._ask(Connect(), Connected, START_S).identity
        except RobotError:
            self._kill()
            raise

    def engage(self) -> None:
        """Take command of the arm; a process that has ended is started anew."""
        self.connect()
        self._ask(Engage(), Done, ENGAGE_S)

    def stop(self) -> None:
        """Stop the arm and give up command. Where no process holds it any more, wait until its own watchdog has."""
        self._reap()
        if self._process is not None:
            try:
                self._ask(Stop(), Done, ANSWER_S)
            except WireError:
                if self._process is not None:
                    raise
            else:
                return
        sleep(COAST_S)

    def begin_epoch(self, epoch: int) -> int:
        """Take up the rules of an epoch and return the outputs it begins with."""
        self.connect()
        return self._ask(BeginEpoch(epoch=epoch), Outputs, ANSWER_S).bits

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it."""
        self.is_in_contact = False
        return self._ask(Seed(), Seeded, ANSWER_S).state

    def stride(self, intent: Intent, grip: GripCommand, *, n_ticks: int, is_hand_busy: bool) -> Stride:
        """Carry out an intent for so many ticks. What latched since the last one is told in its place.

        Raises:
            WireError: the process hangs or has ended; it is gone now.
        """
        request = StrideRequest(intent=intent, grip=grip, n_ticks=n_ticks, is_hand_busy=is_hand_busy)
        told = self._overheard()
        if told is None:
            told = self._ask(request, StrideReply, n_ticks * self._tick_s + STRIDE_SLACK_S)
        stride = told.stride
        self._is_leaving = stride.verdict is not None and stride.verdict.reason in ENDING_REASONS
        self.is_in_contact = stride.is_in_contact
        return stride

    def close(self) -> None:
        """Stop, release and end the process. Idempotent, never raises."""
        when_closed, self._when_closed = self._when_closed, None
        if when_closed is not None:
            when_closed()
        if self._process is None:
            return
        try:
            self._ask(Close(), Done, ANSWER_S)
            self._process.join(CLOSE_S)
        except RobotError:
            pass  # it is ended below
        self._kill()

    def _ask(self, request: Request, expected: type[R], timeout_s: float) -> R:
        """Send a request and return its reply.

        Raises:
            RobotError: what the process raised, by its name; or it hangs, or is gone.
        """
        if self._connection is None or self._is_leaving:
            raise NotEngagedError("servo process: expected one that runs, it has ended; connect and engage again")
        self._overheard()
        try:
            self._connection.send_bytes(self._encode(request))
            is_answered = self._connection.poll(timeout_s)
            raw = self._connection.recv_bytes() if is_answered else b""
        except (EOFError, OSError) as error:
            was_hung = self._watch is not None and self._watch.was_hung
            self._kill()
            if was_hung:
                raise StaleStateError(
                    f"servo process: expected a tick at least every {1e3 * HUNG_S:.0f} ms, none came; it was killed, "
                    "the arm's own watchdog stops the arm"
                ) from error
            raise WireError(
                f"servo process: expected an answer, it has ended ({error}); the arm's own watchdog stops the arm"
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

    def _overheard(self) -> StrideReply | None:
        """Return what latched since the last time step, if anything did."""
        if self._connection is None:
            return None
        try:
            reply = self._decode(self._connection.recv_bytes()) if self._connection.poll(0.0) else None
        except (EOFError, OSError):
            return None  # whoever asks next says so
        return reply if isinstance(reply, StrideReply) else None

    def _reap(self) -> None:
        """Clear away a process that has ended, and one that is about to, in its time."""
        if self._is_leaving and self._process is not None:
            self._process.join(LEAVE_S)
            self._kill()
        elif self._process is not None and not self._process.is_alive():
            self._kill()

    def _kill(self) -> None:
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        watch, self._watch = self._watch, None
        self._is_leaving = False
        if watch is not None:
            watch.close()
        if connection is not None:
            connection.close()
        if process is not None:
            if process.is_alive():
                process.kill()
            process.join(CLOSE_S)


def _error(failure: Failure) -> RobotError:
    """Return the error that the process raised, or its nearest kind."""
    kind = getattr(errors, failure.kind, WireError)
    return kind(failure.message)
