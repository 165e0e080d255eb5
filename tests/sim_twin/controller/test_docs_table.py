"""The table of what the virtual controller does names everything that the code has, and nothing that it has not."""

import re
from pathlib import Path

import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.control_port import CONTROL
from sim_twin.controller.outputs import _constants
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.wire import ControllerVersion
from sim_twin.controller.wire.dashboard import DashboardServer
from sim_twin.controller.wire.rtde_codec import Kind
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
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


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


def test_every_builtin_function_of_the_code_is_in_the_table_and_no_other(robot):
    functions = program_builtins(robot.machine, Sockets(slice_s=0.002))
    assert names("URScript built-in functions", there=True) == set(functions)


def test_every_dashboard_command_is_in_the_table_and_what_is_absent_is_absent(robot):
    known = set()
    for version in (ControllerVersion(major=5, minor=26), ControllerVersion(major=3, minor=15)):
        known |= set(DashboardServer(target=robot.panel, version=version)._commands)
    assert names("Dashboard commands", there=True) == known
    assert {name.lower() for name in names("Dashboard commands", there=False)} & known == set()


def test_every_rtde_message_and_every_constant_field_is_named():
    assert names("RTDE messages", there=True) == {chr(kind) for kind in Kind}
    prose = [line for line in SECTIONS["RTDE messages"].splitlines() if not line.startswith("|")]
    assert set(re.findall(r"`([^`]+)`", "\n".join(prose))) == set(_constants())


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
