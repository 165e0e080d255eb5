"""One process of a machine at a time holds the arm at an address. The edge: a name in the operating system.

Two robot nodes, or one that stands still and a person who drives past it, would each take the arm while the other lets
people reach in; and each would confirm a stop for the other. The name goes with the process, however that ends. It says
nothing of other machines: an arm's own wire has one (docs/lab.md).
"""

import socket
import struct

from robot.errors import WireError

__all__ = ["SoleHolder"]

_CREDENTIALS = struct.Struct("3i")


class SoleHolder:
    """Holds the name of an arm's address, from `take` to `release`.

    Args:
        address: host or IP address of the controller.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._name: socket.socket | None = None

    def take(self) -> None:
        """Take the name, unless it is ours already.

        Raises:
            WireError: another process has it.
        """
        if self._name is not None:
            return
        name = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            name.bind(self._path)
            name.listen(1)
        except OSError as error:
            name.close()
            raise WireError(
                f"arm at {self._address}: another process of this machine holds it{self._whose()}, a robot node or who "
                "drives it: end that one first; where it stands still, wake it or kill it, and look at the arm"
            ) from error
        self._name = name

    def release(self) -> None:
        """Give the name back. Idempotent."""
        name, self._name = self._name, None
        if name is not None:
            name.close()

    @property
    def _path(self) -> str:
        return f"\0autotelic arm {self._address}"  # in the abstract namespace: no file is left behind

    def _whose(self) -> str:
        """Return in words which process has it, empty where that cannot be told."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
            asking.setblocking(False)
            try:
                asking.connect(self._path)
                told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            except OSError:
                return ""
        return f" (process {_CREDENTIALS.unpack(told)[0]})"
