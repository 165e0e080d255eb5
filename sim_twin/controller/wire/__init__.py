"""The controller's TCP ports: RTDE, dashboard, state and script ports, and the gripper's."""

from sim_twin.controller.wire.dashboard_target import Awaited, DashboardStatus, DashboardTarget, Outcome
from sim_twin.controller.wire.gripper_port import GripperMeasurement, GripperRequest, GripperTarget
from sim_twin.controller.wire.reactor import Port
from sim_twin.controller.wire.rtde_fields import FieldType, Value, input_fields, output_fields
from sim_twin.controller.wire.rtde_server import InputSink, Outputs
from sim_twin.controller.wire.state_ports import PortKind, ScriptSink, ScriptSource, StateSource
from sim_twin.controller.wire.version import ControllerVersion
from sim_twin.controller.wire.wires import Wires

__all__ = [
    "Awaited",
    "ControllerVersion",
    "DashboardStatus",
    "DashboardTarget",
    "FieldType",
    "GripperMeasurement",
    "GripperRequest",
    "GripperTarget",
    "InputSink",
    "Outcome",
    "Outputs",
    "Port",
    "PortKind",
    "ScriptSink",
    "ScriptSource",
    "StateSource",
    "Value",
    "Wires",
    "input_fields",
    "output_fields",
]
