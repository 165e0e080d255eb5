"""A UR controller's terminals alone: inputs are read and outputs switched by clients that cannot move an arm.

Neither of them uploads a program, stops one, or holds a register that a motion is commanded by.
"""

import time
from contextlib import suppress
from types import TracebackType
from typing import Self

from dashboard_client import DashboardClient
from rtde_receive import RTDEReceiveInterface

from robot.errors import ArmRefusedError, WireError
from robot.hal.rtde_outputs import N_OUTPUTS, DigitalOutputs
from robot.hal.rtde_probe import probe_rtde
from robot.hal.ur_primary import read_facts
from robot.hal.ur_state import Runtime, check_version

__all__ = ["UrTerminals"]

RATE_HZ = 125.0
ALL_BITS = (1 << N_OUTPUTS) - 1
RESTORED_S, LOOK_S, LOST_S = 0.5, 0.01, 0.5
"""How long outputs may take to read as they were, how long between two looks, and how long the time may stand still."""
IDLE = (Runtime.STOPPED, Runtime.STOPPING)


class UrTerminals:
    """The control box's sixteen digital inputs and outputs, while it is entered.

    Args:
        address: Host or IP address of the controller.

    Attributes:
        serial: As the controller says.
        is_switched: An output was switched since.
        is_restored: Left, with the outputs read as they were when it was entered.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._receive: RTDEReceiveInterface | None = None
        self._outputs: DigitalOutputs | None = None
        self._before = 0
        self.serial = ""
        self.is_switched = self.is_restored = False

    def __enter__(self) -> Self:
        """Connect, and remember how the outputs are.

        Raises:
            WireError: the controller does not answer.
            RobotConfigError: it is another kind of controller than this package is for.
            ArmRefusedError: a program runs on it, which would have a word in its outputs too.
        """
        read_facts(self._address, greeted=check_version)  # PolyScope X has no dashboard that could be asked
        try:
            probe_rtde(self._address)
            dashboard = DashboardClient(self._address)
            dashboard.connect()
            self.serial = dashboard.getSerialNumber().strip()
            dashboard.disconnect()
            self._receive = receive = RTDEReceiveInterface(self._address, RATE_HZ)
            is_free = int(receive.getRuntimeState()) in IDLE
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
            self._switch(self._before)
            self.is_restored = self._is_as_it_was()
        self.close()

    def inputs(self) -> int:
        """Return the input terminals as bits.

        Raises:
            WireError: the link was lost.
            ArmRefusedError: a program has begun on the arm.
        """
        return self._free().getActualDigitalInputBits() & ALL_BITS

    def outputs(self) -> int:
        """Return the output terminals as bits, as the controller has them. Raises WireError where the link was lost."""
        return self._linked().getActualDigitalOutputBits() & ALL_BITS

    def put(self, pins: int) -> None:
        """Switch the output terminals that differ.

        Raises:
            WireError: the link was lost.
            ArmRefusedError: the controller did not take one, or a program has begun on the arm.
        """
        self._free()
        assert self._outputs is not None, "entered"
        self.is_switched |= pins != self._outputs.bits
        self._switch(pins)

    def _switch(self, pins: int) -> None:
        """Switch terminals, whatever runs on the arm: so they return to what they were."""
        assert self._outputs is not None, "entered"
        self._linked()
        try:
            untaken = self._outputs.put(pins)
        except RuntimeError as error:
            raise WireError(self._lost(str(error))) from error
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

    def _linked(self) -> RTDEReceiveInterface:
        """Return the reading client. Raises WireError where its link was lost: what it says then is old."""
        receive = self._receive
        assert receive is not None, "entered"
        begun_s, end_s = receive.getTimestamp(), time.monotonic() + LOST_S
        while receive.getTimestamp() == begun_s:  # the controller's own time: the client's word of its link is late
            if time.monotonic() > end_s:
                raise WireError(self._lost("its time stands still"))
            time.sleep(LOOK_S / 5.0)
        return receive

    def _free(self) -> RTDEReceiveInterface:
        """Return the reading client. Raises ArmRefusedError where a program runs by now, WireError where it is lost."""
        receive = self._linked()
        if int(receive.getRuntimeState()) not in IDLE:
            raise ArmRefusedError(
                "expected no program on the arm, one has begun since: whoever started it must stop it, it has a word "
                "in the outputs too; then walk again"
            )
        return receive

    def _lost(self, why: str) -> str:
        return (
            f"terminals: the link to {self._address} was lost ({why}): is the controller on, and its cable in? Then "
            "walk again"
        )

    def _is_as_it_was(self) -> bool:
        """Return whether the outputs come to read as they were."""
        end_s = time.monotonic() + RESTORED_S
        while self.outputs() != self._before:
            if time.monotonic() > end_s:
                return False
            time.sleep(LOOK_S)
        return True
