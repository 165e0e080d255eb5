"""The table of what the virtual controller does names everything that the code has, and nothing that it has not."""

import re
from pathlib import Path

import numpy as np
import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.builtins.versions import ANY, SINCE
from sim_twin.controller.control_port import CONTROL
from sim_twin.controller.outputs import COPIES
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.states import Event
from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.dashboard import DashboardServer
from sim_twin.controller.wire.primary_messages import _Type
from sim_twin.controller.wire.primary_state import PrimaryState
from sim_twin.controller.wire.rtde_codec import Kind
from sim_twin.controller.wire.state_ports import StatePorts
from sim_twin.controller.wire.wires import Wires
from tests.support.virtual_robot import make_robot

TEXT = (Path(__file__).parents[3] / "docs" / "virtual-controller-table.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## ([^\n]+)\n(.*?)(?=^## |\Z)", TEXT, flags=re.M | re.S))
STATES = ("exact", "approximate: ", "absent")


@pytest.fixture(scope="module")
def robot():
    return make_robot()


def rows(section):
    """Return a table's rows below its head, as lists of cells."""
    lines = [line for line in SECTIONS[section].splitlines() if line.startswith("|")]
    found = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    is_rule = [row[0].startswith("---") for row in found]
    return [row for k, row in enumerate(found) if not any(is_rule[k : k + 2])]


def names(section, *, there):
    """Return the names in the first column of what is there, or of what is absent."""
    kept = [row for row in rows(section) if row[-1].startswith("absent") is not there]
    found = [name for row in kept for name in re.findall(r"`([^`]+)`", row[0])]
    assert len(found) == len(set(found))
    return set(found)


@pytest.mark.parametrize("section", [name for name in SECTIONS if name != "Clients"])
def test_every_row_says_exact_approximate_and_how_or_absent(section):
    assert rows(section)
    assert [row for row in rows(section) if not row[-1].startswith(STATES)] == []


def test_every_builtin_function_of_the_code_is_in_the_table_and_no_other():
    robot = make_robot(version=ControllerVersion(minor=99))
    functions = program_builtins(robot.machine, Sockets(slice_s=0.002))
    assert names("URScript built-in functions", there=True) == set(functions)


def as_told(since):
    """Return a first version as the table has it."""
    return "never" if since is None else "any" if since == ANY else ".".join(map(str, since))


def test_every_builtin_function_is_told_with_the_version_that_brought_it():
    told = {name: row[1] for row in rows("URScript built-in functions") for name in quoted(row[0])}
    known = {name: f"{as_told(e_series)}; CB3 {as_told(cb3)}" for name, (e_series, cb3) in SINCE.items()}
    assert told == dict.fromkeys(told, "any") | known


def test_every_dashboard_command_is_in_the_table_and_what_is_absent_is_absent(robot):
    known = set()
    for version in (ControllerVersion(major=5, minor=26), ControllerVersion(major=3, minor=15)):
        known |= set(DashboardServer(target=robot.panel, version=version)._commands)
    assert names("Dashboard commands", there=True) == known
    assert {name.lower() for name in names("Dashboard commands", there=False)} & known == set()


def tables(section):
    """Return a section's tables, each as its rows below the head."""
    found = re.findall(r"(?m)^\|[^\n]*\n\|[-|]+\n((?:\|[^\n]*\n)+)", SECTIONS[section])
    return [[[cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines()] for body in found]


def quoted(text):
    return re.findall(r"`([^`]+)`", text)


def test_every_rtde_message_is_named():
    messages, _ = tables("RTDE messages")
    assert {name for row in messages for name in quoted(row[0])} == {chr(kind) for kind in Kind}


def test_every_copy_is_named_with_what_it_copies(robot):
    _, copies = tables("RTDE messages")
    told = {name: quoted(row[1])[0] for row in copies for name in quoted(row[0])}
    assert told == COPIES


MAY_MOVE = {
    *["actual_digital_input_bits", "actual_digital_output_bits", "actual_configurable_digital_input_bits"],
    *["actual_configurable_digital_output_bits", "analog_io_types", "standard_analog_output0"],
    *["standard_analog_input0", "standard_analog_input1"],
    *["standard_analog_output1", "tool_output_voltage", "tcp_offset", "payload", "payload_cog", "payload_inertia"],
    *["target_gravity", "target_speed_fraction", "safety_mode", "safety_status", "safety_status_bits"],
    *["joint_mode", "tool_mode", "robot_mode", "robot_status_bits", "speed_scaling"],
    *["actual_TCP_force", "tcp_force_scalar"],
}
"""What a moving arm leaves alone, though clients, programs or people set it."""


def test_every_output_that_nothing_moves_is_named_as_a_constant():
    """The code is not asked what is constant: the arm moves, and whatever stays has to be told."""
    robot = make_robot()
    registers = set(robot.machine.registers.getters())
    seen = {name: set() for name in robot.outputs if name not in registers}
    rng = np.random.default_rng(3)
    for _ in range(4):
        q = (robot.machine.drive.measured.q_rad + rng.uniform(-0.1, 0.1, 6)).tolist()
        robot.submit_script(f"def f():\n movej({q}, a=5, v=1)\nend\n")
        for _ in range(60):
            robot.step()
            for name, values in seen.items():
                values.add(repr(robot.outputs[name]()))
        robot.machine.execution_s += 1e-4
    robot.close()
    constant = {name for name, values in seen.items() if len(values) == 1} - MAY_MOVE - COPIES.keys()
    prose = "\n".join(line for line in SECTIONS["RTDE messages"].splitlines() if not line.startswith("|"))
    assert set(quoted(prose)) == constant


def test_every_port_that_listens_is_in_the_table(robot):
    version = ControllerVersion()
    wires = Wires(
        outputs=robot.outputs, inputs=robot.machine, dashboard=robot.panel, states=robot.panel, scripts=robot,
        gripper=robot.hand, version=version, stamp_us=lambda: 0,
    )  # fmt: skip
    wires.open("127.0.0.65")
    opened = set(wires.port_by_number)
    wires.close()
    there = [row[0] for row in rows("Ports") if not row[-1].startswith("absent")]
    assert {int(port) for ports in there for port in re.findall(r"\d+", ports)} == {*opened, CONTROL}


ROBOT_STATE, ROBOT_MESSAGE = 16, 20


def test_every_primary_message_is_in_the_table_and_what_is_there_is_sent():
    robot = make_robot()
    ports = StatePorts(states=robot.panel, scripts=robot, version=ControllerVersion(), stamp_us=lambda: 0)
    sent = [ports.primary._greet()]
    for body in ('textmsg("a")', 'popup("a", "b", blocking=False)', "movej([1, 2])"):
        robot.submit_script(f"def f():\n {body}\n sync()\nend\n")
        for _ in range(20):
            robot.step()
    robot.programs.handle(Event.PROTECTIVE_STOP)
    sent += robot.machine.journal.outbox
    assert {message[4] for message in sent} == {ROBOT_MESSAGE}
    there = [row[0] for row in rows("Primary messages") if not row[-1].startswith("absent")]
    told = {int(number) for names in there for number in re.findall(r"\((\d+)\)", names)}
    assert told == {message[14] for message in sent} | {ROBOT_STATE}
    assert told == {*_Type, ROBOT_STATE}


def test_every_part_of_the_robot_state_is_in_the_table_and_sent(robot):
    (told,) = [row[0] for row in rows("Primary messages") if f"({ROBOT_STATE})" in row[0]]
    parts = [part.removeprefix("robot ").removesuffix(" info") for part in told.split("sub-packages ")[1].split(", ")]
    assert [part.replace(" ", "_") for part in parts] == list(PrimaryState.__struct_fields__)
    state = robot.panel.primary_state()
    assert [part for part in PrimaryState.__struct_fields__ if getattr(state, part) is None] == []
