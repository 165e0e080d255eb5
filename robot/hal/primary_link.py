"""A connection to the primary interface that is read where somebody looks, without waiting. The edge: a socket."""

import socket
from select import POLLIN, poll

from robot.errors import WireError
from robot.hal.ur_calls import what_to_try
from robot.hal.ur_primary import PRIMARY_PORT, split_packages

__all__ = ["PrimaryLink"]

CONNECT_S = 2.0
N_BYTES = 1 << 16


class PrimaryLink:
    """Hears from `open` to `close` what a controller tells.

    Args:
        address: host or IP address of the controller.
        port: its primary interface's.
    """

    def __init__(self, address: str, *, port: int = PRIMARY_PORT) -> None:
        self.at = (address, port)
        self._link: socket.socket | None = None
        self._unread = b""

    @property
    def is_open(self) -> bool:
        """Whether there is a connection, as far as is known."""
        return self._link is not None

    def open(self) -> None:
        """Connect: what is told from now on is heard at a look.

        Raises:
            WireError: nobody answers.
        """
        host, port = self.at
        self.close()
        try:
            self._link = socket.create_connection(self.at, timeout=CONNECT_S)
        except OSError as error:
            said = f"{error or 'none in time'}"
            raise WireError(
                f"primary interface: expected an answer at {host}:{port}, got {said}; {what_to_try(said)}"
            ) from error
        self._poll = poll()
        self._poll.register(self._link, POLLIN)

    def close(self) -> None:
        """Listen no more. Idempotent."""
        link, self._link = self._link, None
        self._unread = b""
        if link is not None:
            link.close()

    def heard(self) -> list[bytes] | None:
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
