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
    pack_intent,
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
        if self._process is not None and self._process.is_alive():
            return
        ours, theirs = get_context("spawn").Pipe()
        process = get_context("spawn").Process(target=serve, args=(theirs, self._resolved_json), daemon=True)
        process.start()
        theirs.close()
        self._process, self._connection = process, ours
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
        """Stop the arm and give up command."""
        self._ask(Stop(), Done, ANSWER_S)

    def begin_epoch(self, epoch: int) -> int:
        """Take up the rules of an epoch and return the outputs it begins with."""
        self.connect()
        return self._ask(BeginEpoch(epoch=epoch), Outputs, ANSWER_S).bits

    def seed(self) -> ArmState:
        """Start everything from the measured state, and return it."""
        self.is_in_contact = False
        return self._ask(Seed(), Seeded, ANSWER_S).state

    def stride(self, intent: Intent, grip: GripCommand, *, n_ticks: int, is_hand_busy: bool) -> Stride:
        """Carry out an intent for so many ticks.

        Raises:
            WireError: the process hangs or has ended; it is gone now.
        """
        request = StrideRequest(intent=pack_intent(intent), grip=grip, n_ticks=n_ticks, is_hand_busy=is_hand_busy)
        stride = self._ask(request, StrideReply, n_ticks * self._tick_s + STRIDE_SLACK_S).stride
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
        if self._connection is None:
            raise NotEngagedError("servo process: expected one that runs, it has ended; connect and engage again")
        try:
            self._connection.send_bytes(self._encode(request))
            is_answered = self._connection.poll(timeout_s)
            raw = self._connection.recv_bytes() if is_answered else b""
        except (EOFError, OSError) as error:
            self._kill()
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

    def _kill(self) -> None:
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
        if process is not None and process.is_alive():
            os.kill(process.pid or 0, signal.SIGKILL)
            process.join(CLOSE_S)


def _error(failure: Failure) -> RobotError:
    """Return the error that the process raised, or its nearest kind."""
    kind = getattr(errors, failure.kind, WireError)
    return kind(failure.message)
