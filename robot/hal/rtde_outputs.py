"""The control box's digital outputs over RTDE, as bits: standard ones below, configurable ones above."""

import ctypes

from rtde_io import RTDEIOInterface

__all__ = ["N_OUTPUTS", "DigitalOutputs"]

N_OUTPUTS = 16
N_STANDARD = 8
STRAY_NS = 100_000_000
"""So long a terminal may read otherwise than it was asked: it is on its way, or late. Then somebody else has it."""


class DigitalOutputs:
    """Writes what changes.

    Args:
        address: the controller's.
        bits: the outputs as they are.

    Attributes:
        bits: The outputs as the controller took them last.

    Raises:
        RuntimeError: the client cannot connect.
    """

    def __init__(self, address: str, *, bits: int) -> None:
        self._client = RTDEIOInterface(address)
        self.bits = bits
        self._asked, self._straying, self._since_ns = bits, 0, 0

    def put(self, bits: int) -> int | None:
        """Switch the outputs that differ; return the first that the controller did not take, None where it took all."""
        changed = self.bits ^ bits
        if not changed:
            return None
        for i in range(N_OUTPUTS):
            if not changed >> i & 1:
                continue
            if not self._switch(i, is_on=bool(bits >> i & 1)):
                return i
            self.bits ^= 1 << i
        return None

    def strayed(self, read: int, mask: int, *, now_ns: int) -> int | None:
        """Return the first terminal that has not been as asked for 100 ms, None where none is.

        The client says only that it sent: an output that the installation keeps for itself does not follow.

        Args:
            read: the outputs as the controller tells them.
            mask: those that are driven from here.
            now_ns: monotonic time.
        """
        wrong = (read ^ self.bits) & mask
        going_on = wrong & self._straying & ~(self.bits ^ self._asked)
        self._asked = self.bits
        if not going_on:
            self._straying, self._since_ns = wrong, now_ns
            return None
        self._straying = going_on
        if now_ns - self._since_ns <= STRAY_NS:
            return None
        return (going_on & -going_on).bit_length() - 1

    def close(self) -> None:
        """Close the client; the outputs stay as they are. Never raises."""
        try:
            self._client.disconnect()
        except RuntimeError:
            # Its link is broken: it would disconnect again as it goes, and end the process by that. So it never goes.
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._client))

    def _switch(self, i: int, *, is_on: bool) -> bool:
        if i < N_STANDARD:
            return self._client.setStandardDigitalOut(i, is_on)
        return self._client.setConfigurableDigitalOut(i - N_STANDARD, is_on)
