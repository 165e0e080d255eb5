"""Shows a line on an arm's own pendant: who can read it is at the arm. The edge: the controller's dashboard port."""

import socket

from robot.errors import WireError

__all__ = ["Pendant"]

PORT = 29999
TIMEOUT_S = 3.0
SHOWN = "showing popup"
N_BYTES = 4096


class Pendant:
    """Shows text as a popup on the pendant of the arm at an address. Moves nothing, stops nothing.

    Args:
        address: host of the controller.
        port: its dashboard port.
    """

    def __init__(self, address: str, *, port: int = PORT) -> None:
        self._at = (address, port)

    def __call__(self, text: str) -> None:
        """Show a line.

        Raises:
            WireError: nobody answers there, or the pendant does not show it.
        """
        line = " ".join(text.split())
        try:
            with socket.create_connection(self._at, timeout=TIMEOUT_S) as link, link.makefile("rb") as answers:
                answers.readline(N_BYTES)  # it greets first
                link.sendall(f"popup {line}\n".encode())
                answer = answers.readline(N_BYTES).decode(errors="replace").strip()
        except OSError as error:
            raise WireError(f"pendant at {self._at[0]}: expected it to show a line, {error}") from error
        if answer != SHOWN:
            raise WireError(f"pendant at {self._at[0]}: expected {SHOWN!r}, came {answer!r}: nothing is shown there")
