"""All ports of one controller on one address, as its owner holds them."""

from collections.abc import Callable
from types import MappingProxyType
from typing import Self

from sim_twin.controller.wire.dashboard import DashboardServer
from sim_twin.controller.wire.dashboard_target import DashboardTarget
from sim_twin.controller.wire.gripper_port import GripperServer, GripperTarget
from sim_twin.controller.wire.peer import Budget
from sim_twin.controller.wire.reactor import Port, Reactor
from sim_twin.controller.wire.rtde_server import InputSink, Outputs, RtdeServer
from sim_twin.controller.wire.state_ports import SCRIPT_BUDGET, ScriptSink, StatePorts, StateSource
from sim_twin.controller.wire.version import ControllerVersion

__all__ = ["DASHBOARD", "GRIPPER", "RTDE", "SCRIPTS", "Wires"]

DASHBOARD = 29999
RTDE = 30004
GRIPPER = 63352
SCRIPTS = 30002
"""One of those that scripts are taken at."""
# What one peer can cost in one poll follows from these: some 2 ms at worst, for a flood of the smallest messages.
_LINES = Budget(bytes_a_poll=256)
_REGISTERS = Budget(bytes_a_poll=2048)


class Wires:
    """Every server, opened on one address and moved by the owner's tick.

    Each tick: `poll`, then the controller's step, then `tick` with the new step's number.

    Attributes:
        rtde: The RTDE server, for its text messages.
        states: The state ports, for robot messages.
    """

    def __init__(
        self,
        *,
        outputs: Outputs,
        inputs: InputSink,
        dashboard: DashboardTarget,
        states: StateSource,
        scripts: ScriptSink,
        gripper: GripperTarget | None,
        version: ControllerVersion,
        stamp_us: Callable[[], int],
        hear: Callable[[str], None] | None = None,
    ) -> None:
        """Store; without a gripper its port stays shut, without hear what RTDE's clients say is lost."""
        self.rtde = RtdeServer(outputs=outputs, inputs=inputs, version=version, hear=hear)
        self.states = StatePorts(states=states, scripts=scripts, version=version, stamp_us=stamp_us)
        self._dashboard = DashboardServer(target=dashboard, version=version)
        self._gripper = None if gripper is None else GripperServer(target=gripper)
        self._reactor = Reactor()
        self._port_by_number: dict[int, Port] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def port_by_number(self) -> MappingProxyType[int, Port]:
        """The open ports by UR's numbers; faults are set on them."""
        return MappingProxyType(self._port_by_number)

    @property
    def n_peers(self) -> int:
        """Open connections of all ports."""
        return self._reactor.n_peers

    def open(self, host: str, *, is_free: bool = False) -> None:
        """Listen on UR's port numbers, or on free ones for tests; a failure leaves nothing open.

        Raises:
            OSError: A port is taken or the address is none of this machine's.
        """
        listen = self._reactor.listen
        try:
            self._port_by_number[DASHBOARD] = listen(host, 0 if is_free else DASHBOARD, self._dashboard, _LINES)
            self._port_by_number[RTDE] = listen(host, 0 if is_free else RTDE, self.rtde, _REGISTERS)
            for number, service in self.states.by_number.items():
                self._port_by_number[number] = listen(host, 0 if is_free else number, service, SCRIPT_BUDGET)
            if self._gripper is not None:
                self._port_by_number[GRIPPER] = listen(host, 0 if is_free else GRIPPER, self._gripper, _LINES)
        except OSError:
            self.close()
            raise

    def poll(self) -> None:
        """Take what has arrived and answer it."""
        self._reactor.poll()

    def tick(self, control_step: int) -> None:
        """Send the packages that are due in this 2 ms step, and replies that waited."""
        self._dashboard.tick()
        self.rtde.tick(control_step)
        self.states.tick(control_step)

    def close(self) -> None:
        """Shut every port; a second call does nothing."""
        self._reactor.close()
