"""A controller in a process of its own, for tests and for whoever wants one beside a client."""

import socket
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import Self

import msgspec

from config.errors import ConfigError
from robot.realtime import take_priority
from sim_twin.controller.control_port import CONTROL
from sim_twin.controller.server import PRIORITY, ControllerServer, Setup

__all__ = ["ControllerProcess", "ControllerProcessError", "ask_fault"]

START_S, STOP_S, ANSWER_S = 60.0, 5.0, 5.0
_READY, _END = b"ready", b"end"


class ControllerProcessError(RuntimeError):
    """The controller did not start, or a fault was refused."""


def ask_fault(host: str, name: str, /, **numbers: object) -> dict[str, object]:
    """Bring a fault about at a running controller and return what it tells.

    Raises:
        ControllerProcessError: nobody answers there, or the fault is refused.
    """
    line = msgspec.json.encode({"fault": name, **numbers}) + b"\n"
    try:
        with socket.create_connection((host, CONTROL), timeout=ANSWER_S) as connection:
            connection.sendall(line)
            answer = connection.makefile("rb").readline()
    except OSError as error:
        raise ControllerProcessError(
            f"expected a virtual controller at {host}:{CONTROL}: {error}; start one with `autotelic controller`"
        ) from error
    found = msgspec.json.decode(answer, type=dict[str, object])
    if "error" in found:
        raise ControllerProcessError(str(found["error"]))
    return found


class ControllerProcess:
    """Runs a controller while it is open.

    Args:
        setup: What it is started with.

    Attributes:
        setup: The same.
    """

    def __init__(self, setup: Setup | None = None) -> None:
        self.setup = setup or Setup()
        self._process: SpawnProcess | None = None
        self._line: Connection | None = None

    @property
    def host(self) -> str:
        """The address to connect to."""
        return self.setup.host

    def __enter__(self) -> Self:
        """Start it and wait until its ports are open.

        Raises:
            ControllerProcessError: it did not start.
        """
        context = get_context("spawn")
        self._line, theirs = context.Pipe()
        self._process = process = context.Process(
            target=_serve, args=(msgspec.json.encode(self.setup), theirs), name="virtual controller", daemon=True
        )
        process.start()
        theirs.close()
        said = b"nothing in time"
        try:
            if self._line.poll(START_S):
                said = self._line.recv_bytes()
        except EOFError:
            said = b"it ended"
        if said != _READY:
            self.close()
            raise ControllerProcessError(f"controller at {self.host}: expected it to start, got {said.decode()}")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """The process's number, None while there is none."""
        return None if self._process is None else self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process is not None and self._process.is_alive()

    def fault(self, name: str, /, **numbers: object) -> dict[str, object]:
        """Bring a fault about, or ask for the truth; see `faults`.

        Raises:
            ControllerProcessError: it is refused.
        """
        return ask_fault(self.host, name, **numbers)

    def close(self) -> None:
        """End it; a second call does nothing."""
        if self._line is not None:
            with suppress(OSError):
                self._line.send_bytes(_END)
            self._line.close()
            self._line = None
        if self._process is not None:
            self._process.join(STOP_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
            self._process.close()
            self._process = None


def _serve(setup: bytes, line: Connection) -> None:
    """Run in the process: a closed pipe ends it too."""
    try:
        server = ControllerServer(msgspec.json.decode(setup, type=Setup))
        with server:
            take_priority(PRIORITY)
            server.run(when_ready=lambda: line.send_bytes(_READY), is_over=line.poll)
    except (OSError, ValueError, ConfigError) as error:
        with suppress(OSError):  # nobody waits any more
            line.send_bytes(str(error).encode())
    except KeyboardInterrupt:
        pass
