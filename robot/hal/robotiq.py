"""A Robotiq two-finger gripper over its socket on the UR control box: ASCII lines, never blocking the servo loop.

The port and its commands are those that the URCap opens on the controller: ``GET POS`` answers ``POS 12``, ``SET POS
255`` answers ``ack``. Positions, speeds and forces are bytes.
"""

import socket
from collections.abc import Callable
from time import monotonic_ns

import msgspec

from config.arm import Tool
from robot.errors import WireError
from robot.messages import GripCommand, GripState

__all__ = ["GRIPPER_PORT", "GripScale", "RobotiqGripper"]

GRIPPER_PORT = 63352
FULL = 255
ACKNOWLEDGED = "ack"
HELD_WHILE_OPENING, HELD_WHILE_CLOSING = 1, 2
"""OBJ: 0 under way, 1 stopped while opening, 2 stopped while closing, 3 at the place asked for."""
MOVING = 0
RESET, READY = 0, 3
"""STA: 0 reset, 1 activating, 3 active."""
ASK_EVERY = 8
"""Polls from question to question: at 500 of them a second a hand is seen every 16 ms."""
CHUNK = 256
"""Longer than an answer; so short that no page is asked of the operating system for it."""
NO_VALUE = "?"
"""What the port answers for a gripper that it does not hear: without power, mostly."""
DEAF_LIMIT = 25
ACTIVATE_S = 8.0
"""How long resetting and both strokes may take; the maker's manual gives no bound."""
_FAULTS = {
    5: "it was to move before its activation was over", 7: "it was to move before its activation",
    8: "too hot", 9: "no communication", 10: "too little voltage", 11: "automatic release under way",
    12: "internal fault", 13: "activation failed", 14: "too much current", 15: "automatic release done",
}  # fmt: skip
SILENT_LIMIT, WATCHED_LIMIT = 200, 32
"""Polls without an answer after which a gripper counts as gone that was not commanded yet, and one that was. At 500 a
second the latter is lost after 64 ms, and after 80 where it had just answered: 100 are asked."""


class GripScale(msgspec.Struct, frozen=True, kw_only=True):
    """Bytes of the gripper for openings, speeds and forces of a tool. Linear, as the maker's manual gives it."""

    stroke_m: float
    speed_m_s: tuple[float, float]
    force_n: tuple[float, float]

    @classmethod
    def of(cls, tool: Tool) -> "GripScale":
        """Return the scale of a tool."""
        return cls(stroke_m=tool.stroke_m, speed_m_s=tool.speed_m_s, force_n=tool.force_n)

    def position(self, opening_m: float) -> int:
        """Return the position for an opening: 0 is open, 255 shut."""
        return round(FULL * (1.0 - min(max(opening_m / self.stroke_m, 0.0), 1.0)))

    def opening_m(self, position: int) -> float:
        """Return the opening at a position."""
        return self.stroke_m * (1.0 - position / FULL)

    def speed(self, speed_m_s: float) -> int:
        """Return the byte for a speed of closing."""
        return _byte(speed_m_s, self.speed_m_s)

    def force(self, force_n: float) -> int:
        """Return the byte for a force."""
        return _byte(force_n, self.force_n)


class RobotiqGripper:
    """One connection to a gripper. `poll` each tick; nothing here waits, except `connect`.

    Attributes:
        state: What the gripper last said; None before its first answers.
        n_answers: How often it has said it.
    """

    def __init__(self, scale: GripScale) -> None:
        self._scale = scale
        self._socket: socket.socket | None = None
        self._received = b""
        self._answer: bytes | None = None
        """The last answer to all questions that came in one piece."""
        self._outgoing = b""
        self._said: dict[str, int] = {}
        self._grip: GripCommand | None = None
        self._asked: tuple[int, int, int] | None = None
        self._is_query_out = False
        self._n_silent, self._n_deaf, self._n_since_asked = 0, 0, ASK_EVERY
        self._is_watched = self._is_activating = False
        self.state: GripState | None = None
        self.n_answers = 0

    def connect(self, host: str, *, timeout_s: float = 2.0) -> None:
        """Open the connection; what was said on one before counts no more. Moves nothing.

        Raises:
            WireError: nobody listens there.
        """
        self._received = self._outgoing = b""
        self._answer = None
        self._said.clear()
        self._n_deaf, self._is_watched, self._is_activating = 0, False, False
        self._grip = self._asked = self.state = None
        self._is_query_out, self._n_silent, self._n_since_asked = False, 0, ASK_EVERY
        try:
            self._socket = socket.create_connection((host, GRIPPER_PORT), timeout=timeout_s)
        except OSError as error:
            raise WireError(
                f"gripper: expected a listener at {host}:{GRIPPER_PORT}, got {error}; is its URCap installed, "
                "and the port open under Security > Services?"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    @property
    def is_active(self) -> bool:
        """Whether the gripper has been activated since it got power, and has no fault."""
        said = self._said
        return said.get("STA") == READY and said.get("ACT") == 1 and said.get("FLT") == 0

    def activate(self, see: Callable[[], object], *, limit_s: float = ACTIVATE_S) -> None:
        """Reset and activate: the fingers open and shut all the way, and drop what they hold. Waits for the end.

        Broken off, by whatever, it is taken back: the fingers stop where they are.

        Args:
            see: waits a little and polls; raises where the fingers may not go on.
            limit_s: how long it may take.

        Raises:
            WireError: it did not come to its end in time.
        """
        deadline_ns = monotonic_ns() + round(limit_s * 1e9)
        self._is_activating = True
        try:
            # Activating what is active already does nothing, and nothing else clears a fault.
            self._send("SET ACT 0 GTO 0\n")
            while (self._said.get("STA"), self._said.get("ACT")) != (RESET, 0):
                self._see_in_time(see, deadline_ns)
            self._send("SET ACT 1\n")
            while not self.is_active:
                self._see_in_time(see, deadline_ns)
        except BaseException:
            self._is_query_out = False  # its answer may have been lost with whatever broke in: it is asked again
            self.halt()
            raise
        self._is_activating = False

    def halt(self) -> None:
        """Stop what was asked for from here: fingers that hold something go on holding it, all others stand.

        An activation under way is taken back, so that the next to use the gripper must activate it.

        Raises:
            WireError: the gripper closed the connection.
        """
        asked, is_activating = self._asked, self._is_activating
        self._is_watched = self._is_activating = False
        if is_activating:
            self._send("SET ACT 0\n")
        elif asked is not None and not self._is_holding(asked[0]):
            self._grip = self._asked = None  # the same again is to be sent again
            self._send("SET GTO 0\n")

    def command(self, grip: GripCommand) -> None:
        """Ask for an opening; the same again sends nothing. From now on it must stay active and without a fault."""
        self._is_watched = True
        if grip is self._grip:
            return
        scale, self._grip = self._scale, grip
        asked = (scale.position(grip.opening_m), scale.speed(grip.speed_m_s), scale.force(grip.force_n))
        if asked != self._asked:
            self._asked = asked
            position, speed, force = asked
            self._send(f"SET SPE {speed} FOR {force} POS {position} GTO 1\n")

    def poll(self, *, is_awaited: bool = False) -> GripState | None:
        """Ask the next question if it is time, or take in answers, and return the newest state.

        Args:
            is_awaited: ask as soon as the last question is answered.

        Raises:
            WireError: the gripper closed the connection or has been silent for too long, has no power, or, once it was
                commanded, is not active any more or tells of a fault.
        """
        self._flush()
        self._n_since_asked += 1
        if not self._is_query_out:
            if is_awaited or self._n_since_asked >= ASK_EVERY:
                self._send("GET POS\nGET OBJ\nGET STA\nGET FLT\nGET ACT\n")
                self._is_query_out, self._n_silent, self._n_since_asked = True, 0, 0
            return self.state
        self._receive()
        self._n_silent += 1
        limit = WATCHED_LIMIT if self._is_watched else SILENT_LIMIT
        if self._is_query_out and self._n_silent > limit:
            raise WireError(f"gripper: expected an answer within {limit} polls, got none; is it powered?")
        return self.state

    def close(self) -> None:
        """Close the connection; the fingers stay as they are. Idempotent."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, text: str) -> None:
        self._outgoing += text.encode()
        self._flush()

    def _flush(self) -> None:
        if not self._outgoing:
            return
        try:
            sent = self._open().send(self._outgoing)
        except BlockingIOError:
            return
        except OSError as error:
            raise WireError(f"gripper: expected to send, got {error}") from error
        self._outgoing = self._outgoing[sent:]

    def _receive(self) -> None:
        try:
            chunk = self._open().recv(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            raise WireError(f"gripper: expected an answer, got {error}") from error
        if not chunk:
            raise WireError("gripper: expected an answer, the connection was closed by the other side")
        if chunk == self._answer and not self._received:
            self._note_answer()  # the same as before, word by word
            return
        is_whole, n_answers, self._answer = not self._received, self.n_answers, None
        *lines, self._received = (self._received + chunk).split(b"\n")
        for line in lines:
            self._take_in(line.decode("ascii", "replace"))
        if is_whole and not self._received and self.n_answers == n_answers + 1:
            self._answer = chunk

    def _take_in(self, line: str) -> None:
        while line.startswith(ACKNOWLEDGED):  # sent without an end of line, before the next answer
            line = line[len(ACKNOWLEDGED) :]
        words = line.split()
        if words == [NO_VALUE] and (self._is_watched or self._is_activating):
            raise WireError("gripper: expected `ack` of what it was told, came `?`: it does not take it")
        if len(words) == 2 and words[1] == NO_VALUE:
            self._note_deaf(words[0])
        if len(words) != 2 or not words[1].isdigit():
            return
        self._said[words[0]] = int(words[1])
        if words[0] == "ACT":  # the last of the five questions
            self._note_answer()
            self._tell()

    def _note_answer(self) -> None:
        self._is_query_out, self._n_deaf = False, 0
        self.n_answers += 1
        self._judge()

    def _note_deaf(self, name: str) -> None:
        self._said.pop(name, None)
        if name != "ACT":
            return
        self._is_query_out = False
        self._n_deaf += 1
        if self._n_deaf >= DEAF_LIMIT:
            raise WireError("gripper: expected values, its port has none; has the tool power, and is it plugged in?")

    def _judge(self) -> None:
        """Raise where a gripper that was commanded does not obey any more."""
        if not self._is_watched or self.is_active:
            return
        said = self._said
        fault = said.get("FLT", 0)
        came = f"fault {fault} ({_FAULTS.get(fault, 'see its manual')})" if fault else "none"
        raise WireError(
            f"gripper: expected it active (STA 3) and no fault, came STA {said.get('STA')}, ACT {said.get('ACT')}, "
            f"{came}; look at it, it is activated when somebody engages again"
        )

    def _is_holding(self, asked: int) -> bool:
        """Return whether something keeps the fingers from the position asked for."""
        at, found = self._said.get("POS", 0), self._said.get("OBJ")
        return (found == HELD_WHILE_CLOSING and asked >= at) or (found == HELD_WHILE_OPENING and asked <= at)

    def _see_in_time(self, see: Callable[[], object], deadline_ns: int) -> None:
        see()
        if monotonic_ns() > deadline_ns:
            said = {name: self._said.get(name) for name in ("ACT", "STA", "FLT")}
            raise WireError(f"gripper: expected its activation to end in time, it says {said}")

    def _tell(self) -> None:
        position, status = self._said.get("POS"), self._said.get("OBJ")
        if position is None or status is None:
            return
        self.state = GripState(
            opening_m=self._scale.opening_m(position),
            is_moving=status == MOVING,
            has_object=status == HELD_WHILE_CLOSING,
        )

    def _open(self) -> socket.socket:
        if self._socket is None:
            raise WireError("gripper: expected connect() first")
        return self._socket


def _byte(value: float, span: tuple[float, float]) -> int:
    low, high = span
    return round(FULL * min(max((value - low) / (high - low), 0.0), 1.0))
