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
        path = f"\0autotelic arm {_number_of(self._address)}"  # in the abstract namespace: no file is left behind
        try:
            name.bind(path)
            name.listen(1)
        except OSError as error:
            name.close()
            raise WireError(
                f"arm at {self._address}: another process of this machine holds it{_whose(path)}, a robot node or who "
                "drives it: end that one first; where it stands still, wake it or kill it, and look at the arm"
            ) from error
        self._name = name

    def release(self) -> None:
        """Give the name back. Idempotent."""
        name, self._name = self._name, None
        if name is not None:
            name.close()


def _number_of(address: str) -> str:
    """Return the IP address that a name stands for, itself where it stands for none: an arm may be called many names.

    Whoever connects to a name that stands for nothing is told so then.
    """
    try:
        return min(str(found[4][0]) for found in socket.getaddrinfo(address, None, family=socket.AF_INET))
    except OSError:
        return address


def _whose(path: str) -> str:
    """Return in words which process has a name, empty where that cannot be told."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.setblocking(False)
        try:
            asking.connect(path)
            told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return ""
    return f" (process {_CREDENTIALS.unpack(told)[0]})"
