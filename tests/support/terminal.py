"""A command at a pseudo-terminal: what a person at an SSH session sees and types."""

import os
import pty
import re
import select
import subprocess
import sys
import termios
import time
from pathlib import Path

__all__ = ["Session"]

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
