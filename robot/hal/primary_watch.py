"""Hears what changes on a controller while its arm is in somebody's command, and what no state that is read now shows.

Whoever sends a program replaces the one that obeys, between two readings of the runtime state: from then on nothing
watches over the link, for a watchdog dies with its program. And a `sec` program sets another tool while ours goes on.
Both are told on the primary interface: that a program was started once, the tool with every package, ten a second.

The edge: a socket, read where somebody looks, without waiting.
"""

import socket
from select import POLLIN, poll
from time import monotonic_ns

from robot.errors import WireError
from robot.hal.protocols import Clock
from robot.hal.ur_calls import what_to_try
from robot.hal.ur_primary import PRIMARY_PORT, parse_key, parse_tool, split_packages
from robot.messages import Vec6

__all__ = ["STARTED", "PrimaryWatch"]

STARTED = "PROGRAM_XXX_STARTED"
"""Title of the key message that tells of a program's start; its text is the program's name."""
CONNECT_S, SETTLE_S, N_SETTLED = 2.0, 2.0, 2
"""What was told before the second state of the robot is of before we listened: the start of our own program."""
TOOL_TOLERANCE = 1e-4
"""Metres and radians."""
N_BYTES = 1 << 16


class PrimaryWatch:
    """Listens from `begin` to `close`, and tells at a `look` what has changed.

    Args:
        address: host or IP address of the controller.
        tool: the tool centre point that was set, metres and a rotation vector, flange frame.
        port: its primary interface's.
    """

    def __init__(self, address: str, *, tool: Vec6, port: int = PRIMARY_PORT) -> None:
        self._at, self._tool = (address, port), tool
        self._link: socket.socket | None = None
        self._unread = b""

    def begin(self, clock: Clock) -> None:
        """Listen from now on; what is told until the robot's second state is not heard.

        Raises:
            WireError: nobody answers, or nothing is told.
        """
        host, port = self._at
        try:
            self._link = socket.create_connection(self._at, timeout=CONNECT_S)
        except OSError as error:
            said = f"{error or 'none in time'}"
            raise WireError(
                f"primary interface: expected an answer at {host}:{port}, got {said}; {what_to_try(said)}"
            ) from error
        self._poll = poll()
        self._poll.register(self._link, POLLIN)
        n_states, end_ns = 0, monotonic_ns() + round(SETTLE_S * 1e9)
        while n_states < N_SETTLED:
            if monotonic_ns() > end_ns:
                self.close()
                raise WireError(
                    f"primary interface: expected the robot's state from {host}:{port} ten times a second, it did not "
                    f"come {N_SETTLED} times in {SETTLE_S:g} s"
                )
            packages = self._heard()
            if packages is None:
                self.close()
                raise WireError(f"primary interface: {host}:{port} hung up")
            n_states += sum(parse_tool(package) is not None for package in packages)
            clock.wait_tick()

    def look(self) -> tuple[bool, str] | None:
        """Return what has changed since, None for nothing. Does not wait.

        Returns:
            Whether what runs there now is somebody else's, and words for it.
        """
        packages = self._heard()
        if packages is None:
            return False, "its primary interface, which tells who starts a program there, hung up"
        keys = [key for key in map(parse_key, packages) if key is not None and key.title == STARTED]
        if keys:
            what = f"somebody started the program {keys[0].text!r} on its controller"
            return True, f"{what}, and what obeyed us has ended"
        for tool in map(parse_tool, packages):
            if tool is not None and any(abs(a - b) > TOOL_TOLERANCE for a, b in zip(tool, self._tool, strict=True)):
                came = [round(value, 4) for value in tool]
                return False, f"somebody set another tool centre point: {came}, expected {list(self._tool)}"
        return None

    def close(self) -> None:
        """Listen no more. Idempotent."""
        link, self._link = self._link, None
        self._unread = b""
        if link is not None:
            link.close()

    def _heard(self) -> list[bytes] | None:
        """Return the whole packages that have come, None where the other side hung up or speaks something else."""
        if self._link is None:
            return None
        if not self._poll.poll(0):
            return []
        try:
            came = self._link.recv(N_BYTES)
            packages, self._unread = split_packages(self._unread + came)
        except (OSError, WireError):
            return None
        return packages if came else None
