"""One process that the supervisor started, its words led into the logs. The edge."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from threading import Thread

from robot.parent import end_with_parent
from robot.up.logs import Logs
from robot.up.plan import NodePlan

__all__ = ["Child"]


def _end_with_supervisor() -> None:
    """Have this process ended politely when its supervisor is gone.

    Ctrl-C means something to it too, though a shell started its supervisor in the background, deaf to that.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    end_with_parent(signal.SIGTERM)


class Child:
    """A process of a plan. It is in a session of its own, so that Ctrl-C at the terminal is the supervisor's.

    Args:
        plan: what to start.
        logs: where its words go.
    """

    def __init__(self, plan: NodePlan, logs: Logs) -> None:
        self.plan = plan
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from robot.cli import main; main()", *plan.words],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True,
            preexec_fn=_end_with_supervisor, text=True, encoding="utf-8", errors="replace",
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        self.last_line = ""
        self._logs = logs
        self._reader = Thread(target=self._read, name=f"log of {plan.name}", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """Its exit code, negative for a signal; None while it runs."""
        return self._process.poll()

    def send(self, number: signal.Signals) -> None:
        """Send it a signal, if it is there."""
        with suppress(ProcessLookupError):
            self._process.send_signal(number)

    def wait(self, seconds: float) -> bool:
        """Wait for its end and return whether it came."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        self._reader.join(1.0)
        return True

    def kill(self) -> None:
        """End it on the spot."""
        self._process.kill()
        self._process.wait()
        self._reader.join(1.0)

    def _read(self) -> None:
        assert self._process.stdout is not None, "it was piped"
        with self._process.stdout as lines:
            for line in lines:
                self.last_line = line.rstrip() or self.last_line
                self._logs.write(self.plan.name, line.rstrip())
