"""A whole drive by keyboard, on a pseudo-terminal: what a person at an SSH session meets."""

import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

AUTOTELIC = Path(sys.executable).parent / "autotelic"


class Session:
    """A terminal with a drive in it."""

    def __init__(self, *arguments):
        self.typist, self.terminal = pty.openpty()
        self.before = termios.tcgetattr(self.terminal)
        self.seen = b""
        self.process = subprocess.Popen(
            [AUTOTELIC, "teleop", *arguments], stdin=self.terminal, stdout=self.terminal, stderr=self.terminal,
            start_new_session=True, env={**os.environ, "TERM": "xterm-256color", "COLUMNS": "110", "LINES": "30"},
        )  # fmt: skip

    def type(self, keys):
        os.write(self.typist, keys)

    def until(self, pattern, timeout_s=30.0, *, meanwhile=b""):
        """Read on until something is shown; hold a key meanwhile."""
        end = time.monotonic() + timeout_s
        start = len(self.seen)
        while not re.search(pattern, self.text[self.plain_length(start) :]):
            assert time.monotonic() < end, self.text[-3000:]
            if meanwhile:
                self.type(meanwhile)
            if select.select([self.typist], [], [], 0.03)[0]:
                self.seen += os.read(self.typist, 65536)

    def plain_length(self, n):
        return len(plain(self.seen[:n]))

    @property
    def text(self):
        return plain(self.seen)

    def end(self):
        code = None
        end = time.monotonic() + 20.0
        while code is None and time.monotonic() < end:
            if select.select([self.typist], [], [], 0.02)[0]:
                self.seen += os.read(self.typist, 65536)
            code = self.process.poll()
        return code

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.typist)
        os.close(self.terminal)


def plain(raw):
    return re.sub(r"\x1b\[[0-9;?>:]*[A-Za-z]", "", raw.decode(errors="replace"))


@pytest.fixture
def session():
    opened = Session("--rig", "twin", "--no-view")
    yield opened
    opened.close()


def test_a_drive_by_keyboard_moves_while_a_key_repeats_and_ctrl_c_gives_the_terminal_back(session):
    session.until(r"rests: released")
    session.until(r"moves\b", meanwhile=b"a")
    session.until(r"rests: released")
    session.process.send_signal(signal.SIGINT)
    assert session.end() == 0, session.text[-2000:]
    assert "at rest" in session.text
    assert termios.tcgetattr(session.terminal) == session.before


@pytest.mark.slow
def test_it_ends_by_its_key_and_when_the_connection_goes(session):
    session.until(r"rests: released")
    session.type(b"x")
    assert session.end() == 0
    other = Session("--rig", "twin", "--no-view")
    other.until(r"rests: released")
    other.process.send_signal(signal.SIGHUP)
    assert other.end() == 0
    other.close()
