"""The control box's digital outputs over RTDE, as bits: standard ones below, configurable ones above."""

from contextlib import suppress

from rtde_io import RTDEIOInterface

__all__ = ["N_OUTPUTS", "DigitalOutputs"]

N_OUTPUTS = 16
N_STANDARD = 8


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

    def close(self) -> None:
        """Close the client; the outputs stay as they are. Never raises."""
        with suppress(RuntimeError):
            self._client.disconnect()

    def _switch(self, i: int, *, is_on: bool) -> bool:
        if i < N_STANDARD:
            return self._client.setStandardDigitalOut(i, is_on)
        return self._client.setConfigurableDigitalOut(i - N_STANDARD, is_on)
