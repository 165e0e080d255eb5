"""Cell files: every signal once, no terminal twice, pulses whole, and a terminal for all that a scenario has."""

import re

import pytest

from config.cell import CellConfig
from config.errors import ConfigError
from config.kinds import Kind, check_file
from config.loader import load_cell, load_resolved, load_rig, resolve
from config.resolved import dump_resolved
from tests.support.config_files import shipped_tree, write

WRONG = [
    ("inputs", 1, {"pin": "DI0"}, r"inputs\[1\]\.pin.*terminal"),
    ("inputs", 1, {"signal": 0}, r"inputs\[1\]\.signal.*signal"),
    ("inputs", 0, {"pin": "DI8"}, r"inputs\[0\]\.pin"),
    ("inputs", 0, {"pin": "DO0"}, r"inputs\[0\]\.pin"),
    ("inputs", 0, {"signal": 16}, "below 16"),
    ("outputs", 0, {"off_pin": "DO1", "pulse_s": 0.2}, "terminal"),
    ("outputs", 0, {"pulse_s": 0.2}, "off_pin and pulse_s"),
    ("outputs", 15, {"pin": "CO7", "off_pin": "CO7", "pulse_s": 0.2}, "terminal"),
    ("outputs", 15, {"pulse_s": 9.0}, "up to 5"),
]


@pytest.mark.parametrize(("key", "i", "change", "said"), WRONG)
def test_a_wrong_wire_is_told_by_its_place(tmp_path, key, i, change, said):
    tree = shipped_tree("cells", "ur_box")
    tree[key][i] |= change
    with pytest.raises(ConfigError, match=said):
        load_cell(write(tmp_path, "cell.yaml", tree))


def test_a_pulsed_drive_cannot_be_inverted(tmp_path):
    tree = shipped_tree("cells", "ur_box")
    tree["outputs"] = [{"signal": 0, "pin": "DO0", "off_pin": "DO1", "pulse_s": 0.1, "inverted": True}]
    with pytest.raises(ConfigError, match="inverted"):
        load_cell(write(tmp_path, "cell.yaml", tree))


def test_the_arming_signal_is_one_of_the_inputs(tmp_path):
    tree = shipped_tree("cells", "ur_box") | {"arming_signal": 15}
    assert load_cell(write(tmp_path, "cell.yaml", tree)).arming_signal == 15
    tree["inputs"] = tree["inputs"][:15]
    with pytest.raises(ConfigError, match="arming_signal"):
        load_cell(write(tmp_path, "cell.yaml", tree))


@pytest.mark.parametrize(
    ("wires", "said"),
    [
        ([{"signal": 0, "pin": "AI2"}], r"analog_inputs\[0\]\.pin"),
        ([{"signal": 0, "pin": "AI0"}, {"signal": 1, "pin": "AI0"}], r"analog_inputs\[1\]\.pin.*terminal"),
        ([{"signal": 0, "pin": "AI0", "volts": [0.0, 10.5]}], r"analog_inputs\[0\]\.volts"),
        ([{"signal": 0, "pin": "AI0", "volts": [3.0, 3.0]}], r"analog_inputs\[0\]\.volts.*differ"),
    ],
)
def test_a_wrong_analogue_wire_is_told_by_its_place(tmp_path, wires, said):
    tree = shipped_tree("cells", "ur_box") | {"analog_inputs": wires}
    with pytest.raises(ConfigError, match=said):
        load_cell(write(tmp_path, "cell.yaml", tree))


def test_only_a_buttons_travel_is_measured(tmp_path):
    rig = shipped_tree("rigs", "virtual_lab") | {"cell": "./cell.yaml"}
    for signal, is_right in ((0, True), (9, False)):
        wires = [{"signal": signal, "pin": "AI1", "volts": [10.0, 0.0]}]
        write(tmp_path, "cell.yaml", shipped_tree("cells", "ur_box") | {"analog_inputs": wires})
        path = write(tmp_path, "rig.yaml", rig)
        if is_right:
            assert resolve(rig=path).cell.analog_inputs[0].volts == (10.0, 0.0)
        else:
            with pytest.raises(ConfigError, match=r"analog_inputs\[0\]\.signal.*button of scenario paper.*9"):
                resolve(rig=path)


def test_a_cell_that_lacks_a_signal_of_the_scenario_is_refused_by_what_it_is(tmp_path):
    cell, rig = shipped_tree("cells", "ur_box"), shipped_tree("rigs", "virtual_lab")
    cell["outputs"] = [wire for wire in cell["outputs"] if wire["signal"] != 4]
    write(tmp_path, "cell.yaml", cell)
    path = write(tmp_path, "rig.yaml", rig | {"cell": "./cell.yaml"})
    with pytest.raises(ConfigError, match="square_box lid of scenario paper"):
        resolve(rig=path)
    with pytest.raises(ConfigError, match=r"rig\.yaml: cell"):
        resolve(rig=write(tmp_path, "rig.yaml", rig | {"cell": "./none.yaml"}))


def test_the_cell_travels_with_the_rig_and_is_stored_with_the_run(tmp_path):
    resolved = resolve(rig="virtual_lab")
    assert isinstance(resolved.cell, CellConfig)
    assert resolve().cell is None
    path = tmp_path / "config.yaml"
    path.write_text(dump_resolved(resolved))
    assert load_resolved(path) == resolved
    assert check_file(write(tmp_path, "cell.yaml", shipped_tree("cells", "ur_box"))) is Kind.CELL


def test_lab_is_virtual_lab_camera_with_another_address_and_serial_a_real_camera_and_a_person():
    virtual, lab = shipped_tree("rigs", "virtual_lab_camera"), shipped_tree("rigs", "lab")
    assert load_rig("lab").address is None
    differing = {key for key in virtual.keys() | lab.keys() if virtual.get(key) != lab.get(key)}
    person = {"operator", "profile", "reset", "parked_rad"}
    assert differing == {"name", "description", "address", "bus", "nodes", "expected", "camera"} | person
    same = {
        node["name"]: (node.get("kind"), node["command"][:2]) for node in virtual["nodes"] if node["name"] != "twin"
    }
    assert {node["name"]: (node.get("kind"), node["command"][:2]) for node in lab["nodes"]} == same | {
        "hub": ("hub", ["node", "hub"])
    }
    assert [node["name"] for node in lab["nodes"] if node.get("is_by_hand")] == ["robot", "learning"]


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({0: 6.2}, "parked_rad[0]"),  # inside of nothing: the joint's soft margin
        ({1: -3.0}, "parked_rad"),  # the tool beyond its workspace
        ({4: -1.0}, "parked_rad"),  # the hand aslant
    ],
)
def test_where_an_arm_waits_for_a_person_is_inside_of_every_limit(tmp_path, changed, what):
    tree = shipped_tree("rigs", "lab")
    tree["parked_rad"] = [changed.get(i, angle) for i, angle in enumerate(tree["parked_rad"])]
    with pytest.raises(ConfigError, match=re.escape(what)):
        resolve(rig=write(tmp_path, "rig.yaml", tree))
