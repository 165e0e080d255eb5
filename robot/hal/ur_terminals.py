"""A UR controller's terminals alone: inputs are read and outputs switched by clients that cannot move an arm.

Neither of them uploads a program, stops one, or holds a register that a motion is commanded by.
"""

from contextlib import suppress
from types import TracebackType
from typing import Self

from dashboard_client import DashboardClient
from rtde_receive import RTDEReceiveInterface

from robot.errors import ArmRefusedError, WireError
from robot.hal.rtde_outputs import N_OUTPUTS, DigitalOutputs
from robot.hal.rtde_probe import probe_rtde
from robot.hal.ur_state import Runtime

__all__ = ["UrTerminals"]

RATE_HZ = 125.0
ALL_BITS = (1 << N_OUTPUTS) - 1


class UrTerminals:
    """The control box's sixteen digital inputs and outputs, while it is entered.

    Args:
        address: Host or IP address of the controller.

    Attributes:
        serial: As the controller says.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._receive: RTDEReceiveInterface | None = None
        self._outputs: DigitalOutputs | None = None
        self._before = 0
        self.serial = ""

    def __enter__(self) -> Self:
        """Connect, and remember how the outputs are.

        Raises:
            WireError: the controller does not answer.
            ArmRefusedError: a program runs on it, which would have a word in its outputs too.
        """
        try:
            probe_rtde(self._address)
            dashboard = DashboardClient(self._address)
            dashboard.connect()
            self.serial = dashboard.getSerialNumber().strip()
            dashboard.disconnect()
            self._receive = receive = RTDEReceiveInterface(self._address, RATE_HZ)
            is_free = int(receive.getRuntimeState()) in (Runtime.STOPPED, Runtime.STOPPING)
            if is_free:
                self._before = self.outputs()
                self._outputs = DigitalOutputs(self._address, bits=self._before)
        except RuntimeError as error:
            self.close()
            raise WireError(f"terminals: expected an answer at {self._address}, got: {error}") from error
        if not is_free:
            self.close()
            raise ArmRefusedError("expected no program on the arm, one is running: whoever started it must stop it")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the outputs back to what they were, and disconnect."""
        with suppress(WireError):
            self.put(self._before)
        self.close()

    def inputs(self) -> int:
        """Return the input terminals as bits."""
        assert self._receive is not None, "entered"
        return self._receive.getActualDigitalInputBits() & ALL_BITS

    def outputs(self) -> int:
        """Return the output terminals as bits, as the controller has them."""
        assert self._receive is not None, "entered"
        return self._receive.getActualDigitalOutputBits() & ALL_BITS

    def put(self, pins: int) -> None:
        """Switch the output terminals that differ.

        Raises:
            ArmRefusedError: the controller did not take one.
        """
        assert self._outputs is not None, "entered"
        untaken = self._outputs.put(pins)
        if untaken is not None:
            raise ArmRefusedError(f"digital output {untaken}: the controller did not take it")

    def close(self) -> None:
        """Disconnect. Idempotent, never raises."""
        receive, outputs, self._receive, self._outputs = self._receive, self._outputs, None, None
        if outputs is not None:
            outputs.close()
        if receive is not None:
            with suppress(RuntimeError):
                receive.disconnect()
