"""The keyboard of the terminal, over SSH too. The edge: the terminal's settings are taken and given back."""

import os
import select
import sys
import termios
import tty
from collections.abc import Callable

from robot.errors import RobotConfigError
from robot.teleop.device import DriverInput
from robot.teleop.keys import KEYS, KeyBoard, KeyEvent, decode

__all__ = ["Keyboard"]

N_BYTES = 1024
ASK = b"\x1b[?u\x1b[>11u\x1b[?1004h"
"""Does it tell of releases? If so let it; and let it tell when its window is left. Terminals ignore what they lack."""
UNASK = b"\x1b[?1004l\x1b[<u"
LONE_ESCAPE_NS = 50_000_000
"""An escape byte after which nothing came for so long was the escape key."""


class Keyboard:
    """Implements Device with a terminal in cbreak mode: keys come one by one, and are not printed.

    Args:
        detail: nothing is told to a keyboard.
        now_ns: the driver's time.
        step_s: how long it is between two looks; a keyboard does not mind.
        terminal: its file descriptor; standard input where None.
    """

    name = "keyboard"
    keys = KEYS

    def __init__(self, *, detail: str, now_ns: Callable[[], int], step_s: float, terminal: int | None = None) -> None:
        del step_s
        if detail:
            raise RobotConfigError(f"--device keyboard: expected nothing after it, came {detail!r}")
        self._now_ns, self._terminal = now_ns, terminal
        self._fd: int | None = None
        self._board = KeyBoard(now_ns=now_ns)
        self._rest, self._read_ns = b"", 0

    def connect(self) -> None:
        """Take the terminal.

        Raises:
            RobotConfigError: standard input is no terminal.
        """
        try:
            fd = sys.stdin.fileno() if self._terminal is None else self._terminal
            is_terminal = os.isatty(fd)
        except (OSError, ValueError):
            fd, is_terminal = -1, False  # it is closed, or replaced by something that is no file
        if not is_terminal:
            raise RobotConfigError(
                "--device keyboard: expected a terminal as standard input, it is none: try script:FILE"
            )
        self._before = termios.tcgetattr(fd)
        self._fd, self._rest = fd, b""
        self._board = KeyBoard(now_ns=self._now_ns)
        tty.setcbreak(fd, termios.TCSAFLUSH)  # what was typed before is no command
        os.write(fd, ASK)

    def read(self) -> DriverInput:
        """Return what the keys ask now; a terminal that is gone ends the drive."""
        assert self._fd is not None, "connect() comes first"
        try:
            while select.select([self._fd], [], [], 0.0)[0]:
                raw = os.read(self._fd, N_BYTES)
                if not raw:
                    self._board.end()
                    break
                self._take(raw)
        except OSError:
            self._board.end()
        if self._rest == b"\x1b" and self._now_ns() - self._read_ns > LONE_ESCAPE_NS:
            self._rest = b""
            self._board.feed(KeyEvent("esc"))
        return self._board.asked()

    def close(self) -> None:
        """Give the terminal back as it was. Idempotent, never raises."""
        fd, self._fd = self._fd, None
        if fd is None:
            return
        try:
            os.write(fd, UNASK)
            termios.tcsetattr(fd, termios.TCSAFLUSH, self._before)
        except (OSError, termios.error):
            pass  # it is gone

    def _take(self, raw: bytes) -> None:
        events, self._rest = decode(self._rest + raw)
        self._read_ns = self._now_ns()
        for event in events:
            self._board.feed(event)
