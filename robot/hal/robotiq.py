"""A Robotiq two-finger gripper over its socket on the UR control box: ASCII lines, never blocking the servo loop.

The port and its commands are those that the URCap opens on the controller: ``GET POS`` answers ``POS 12``, ``SET POS
255`` answers ``ack``. Positions, speeds and forces are bytes.
"""

import socket

import msgspec

from config.arm import Tool
from robot.errors import WireError
from robot.messages import GripCommand, GripState

__all__ = ["GRIPPER_PORT", "GripScale", "RobotiqGripper"]

GRIPPER_PORT = 63352
FULL = 255
ACKNOWLEDGED = "ack"
HELD_WHILE_CLOSING = 2
"""OBJ: 0 under way, 1 stopped while opening, 2 stopped while closing, 3 at the place asked for."""
MOVING = 0
READY = 3
"""STA: 0 reset, 1 activating, 3 active."""
ASK_EVERY = 8
"""Polls from question to question: at 500 of them a second a hand is seen every 16 ms."""
SILENT_LIMIT = 200
"""Polls without an answer after which the gripper counts as gone."""


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
        self._outgoing = b""
        self._said: dict[str, int] = {}
        self._grip: GripCommand | None = None
        self._asked: tuple[int, int, int] | None = None
        self._is_query_out = False
        self._n_silent, self._n_since_asked = 0, ASK_EVERY
        self.state: GripState | None = None
        self.n_answers = 0

    def connect(self, host: str, *, timeout_s: float = 2.0) -> None:
        """Open the connection; what was said on one before counts no more. Moves nothing.

        Raises:
            WireError: nobody listens there.
        """
        self._received = self._outgoing = b""
        self._said.clear()
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
        """Whether the gripper has been activated since it got power."""
        return self._said.get("STA") == READY and self._said.get("ACT") == 1

    def activate(self) -> None:
        """Begin the activation stroke: the fingers open and shut all the way, and drop what they hold."""
        self._send("SET ACT 1\nSET GTO 1\n")

    def command(self, grip: GripCommand) -> None:
        """Ask for an opening; the same again sends nothing."""
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
            WireError: the gripper closed the connection or has been silent for too long.
        """
        self._flush()
        self._n_since_asked += 1
        if not self._is_query_out:
            if is_awaited or self._n_since_asked >= ASK_EVERY:
                self._send("GET POS\nGET OBJ\nGET STA\nGET ACT\n")
                self._is_query_out, self._n_silent, self._n_since_asked = True, 0, 0
            return self.state
        self._receive()
        self._n_silent += 1
        if self._is_query_out and self._n_silent > SILENT_LIMIT:
            raise WireError(f"gripper: expected an answer within {SILENT_LIMIT} polls, got none; is it powered?")
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
            chunk = self._open().recv(4096)
        except BlockingIOError:
            return
        except OSError as error:
            raise WireError(f"gripper: expected an answer, got {error}") from error
        if not chunk:
            raise WireError("gripper: expected an answer, the connection was closed by the other side")
        *lines, self._received = (self._received + chunk).split(b"\n")
        for line in lines:
            self._take_in(line.decode("ascii", "replace"))

    def _take_in(self, line: str) -> None:
        while line.startswith(ACKNOWLEDGED):  # sent without an end of line, before the next answer
            line = line[len(ACKNOWLEDGED) :]
        words = line.split()
        if len(words) != 2 or not words[1].isdigit():
            return
        self._said[words[0]] = int(words[1])
        if words[0] == "ACT":  # the last of the four questions
            self._is_query_out = False
            self.n_answers += 1
            self._tell()

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
