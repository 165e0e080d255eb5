"""A cell wired in another way than straight through, on the wire: the table's signals arrive as the cell file says."""

import json
import re
import signal
import socket
import subprocess
import time

import msgspec
import pytest
import yaml

from config.cell import CellInput
from config.loader import resolve
from robot.bus.virtual_table import VirtualSomebody
from robot.cell_check import Wire
from robot.cell_cli import arming_wires
from robot.errors import RobotConfigError, RobotError
from robot.hal.rtde_plant import RtdePlant
from robot.messages import ArmCommand, GripCommand
from robot.tick_loop import TickLoop
from tests.support.small_lab import SERIAL, autotelic, controller_of, make_lab, start

pytestmark = pytest.mark.realtime

HOST = "127.0.0.62"
CELL = """\
name: odd
inputs:
  - {signal: 0, pin: CI5}
  - {signal: 1, pin: DI0, inverted: true}
  - {signal: 2, pin: DI7}
outputs:
  - {signal: 0, pin: CO3, inverted: true}
  - {signal: 1, pin: DO0}
  - {signal: 2, pin: DO6, off_pin: CO0, pulse_s: 0.1}
"""
OPEN_HAND = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)
LID = Wire(signal=2, name="chest", what="lid", pin="DO6")
LAMP = Wire(signal=0, name="left_button", what="lamp", pin="CO3")
BUTTON = Wire(signal=0, name="left_button", what="button", pin="CI5")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    make_lab(folder, HOST, cell=CELL)
    with controller_of(folder, HOST, cell=str(folder / "cell.yaml")) as controller:
        yield folder, controller


def walk(folder, rig="rig.yaml"):
    code, out, said = autotelic(folder, "cell", "test", "--rig", rig, "--scenario", "small.yaml", "--auto", "--json")
    assert out, said
    findings = {f"{f['name']} {f['what']}": f for f in json.loads(out)["findings"]}
    return code, findings, said


def rewire(folder, name, change):
    """Write a rig whose cell file says something else than how the controller is wired."""
    tree = yaml.safe_load(CELL)
    change(tree)
    (folder / f"{name}_cell.yaml").write_text(yaml.safe_dump(tree))
    rig = yaml.safe_load((folder / "rig.yaml").read_text()) | {"cell": f"./{name}_cell.yaml"}
    (folder / f"{name}.yaml").write_text(yaml.safe_dump(rig))
    return f"{name}.yaml"


def test_a_walk_through_a_cell_that_is_wired_as_its_file_says_finds_all_right_and_leaves_all_as_it_was(lab):
    folder, controller = lab
    before = controller.fault("truth")
    code, findings, said = walk(folder)
    after = controller.fault("truth")
    assert (code, {f["verdict"] for f in findings.values()}) == (0, {"ok"}), (findings, said)
    assert set(findings) == {
        "left_button button", "right_button button", "chest sensor",
        "left_button lamp", "right_button lamp", "chest lid",
    }  # fmt: skip
    assert after["digital_out"] == before["digital_out"]
    assert after["runtime"] == "STOPPED"
    assert after["q_rad"] == pytest.approx(before["q_rad"], abs=1e-4)


@pytest.mark.slow
def test_wrong_polarity_swapped_pins_and_a_missing_coil_are_each_named(lab):
    folder, _ = lab

    def spoil(tree):
        tree["inputs"][0]["inverted"] = True
        tree["inputs"][1]["pin"], tree["inputs"][2]["pin"] = tree["inputs"][2]["pin"], tree["inputs"][1]["pin"]
        del tree["outputs"][0]["inverted"]
        tree["outputs"][1]["pin"] = "DO1"
        tree["outputs"][2]["off_pin"] = "CO1"

    code, findings, _ = walk(folder, rewire(folder, "spoilt", spoil))
    verdicts = {name: finding["verdict"] for name, finding in findings.items()}
    assert code == 1
    assert verdicts["left_button button"] == "the wrong way round: inverted must be false"
    assert verdicts["right_button button"] == "seen at DI0, expected DI7 alone"
    assert verdicts["chest sensor"] == "seen at DI7, expected DI0 alone"
    assert verdicts["left_button lamp"].startswith("the wrong way round")
    assert verdicts["right_button lamp"].startswith("never seen on")
    assert verdicts["chest lid"] == "never seen off"


def test_an_arm_with_another_serial_is_refused_and_its_wires_are_not_touched(lab):
    folder, controller = lab
    rig = yaml.safe_load((folder / "rig.yaml").read_text())
    rig["expected"]["serial"] = "20190000001"
    (folder / "other.yaml").write_text(yaml.safe_dump(rig))
    before = controller.fault("truth")["digital_out"]
    code, _, said = autotelic(folder, "cell", "test", "--rig", "other.yaml", "--scenario", "small.yaml")
    assert (code, said.count("\n")) == (2, 1)
    assert "serial 20190000001" in said
    assert controller.fault("truth")["digital_out"] == before
    resolved = resolve(rig=folder / "other.yaml", scenario=folder / "small.yaml")
    plant = RtdePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig, cell=resolved.cell)
    with pytest.raises(RobotConfigError, match=f"serial 20190000001.*{SERIAL} at {HOST}"):
        plant.arm.connect()
    plant.arm.close()


@pytest.mark.slow
def test_a_person_is_asked_for_each_wire_and_believed(lab):
    folder, _ = lab
    with start(
        folder, "cell", "test", "--rig", "rig.yaml", "--scenario", "small.yaml", stdin=subprocess.PIPE
    ) as process:
        try:
            with VirtualSomebody(f"tcp/{HOST}:7447", SERIAL) as hand:
                process.stdin.write("\ny\ny\n" + "\nn\ny\n" + "\ny\ny\n")
                process.stdin.flush()
                asked = ""
                for words, name in (
                    ("left_button", "left_button"),
                    ("right_button", "right_button"),
                    ("chest", "chest"),
                ):
                    for is_on, verb in ((True, r"(press and hold|put a cylinder into)"), (False, r"(let go of|empty)")):
                        while not re.search(f"{verb} {words}", asked):
                            letter = process.stderr.read(1)
                            assert letter, asked
                            asked += letter
                        hand._act(Wire(signal=0, name=name, what="button", pin=""), is_on=is_on)
            out, _ = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 1
    verdicts = [line for line in out.splitlines() if re.search(r"(button|sensor|lamp|lid) ", line)]
    assert ["ok" in line for line in verdicts] == [True, True, True, True, False, True], out
    assert "never seen on" in verdicts[4]


def test_the_cell_program_sees_the_button_and_drives_lamp_and_lid_through_these_wires(lab):
    folder, controller = lab
    resolved = resolve(rig=folder / "rig.yaml", scenario=folder / "small.yaml")
    plant = RtdePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig, cell=resolved.cell)
    loop = TickLoop(
        arm=plant.arm,
        config=resolved.arm,
        scenario=resolved.scenario,
        rule_sets=resolved.rule_sets,
        rig=resolved.rig,
        profile=resolved.profile,
    )
    with VirtualSomebody(resolved.rig.bus, SERIAL) as hand:
        try:
            loop.connect()
            assert loop._arm.read().digital_in == 0
            loop.begin_epoch(0)
            loop.engage()
            loop.seed()
            loop.rest()
            for _ in range(100):
                assert loop.tick(OPEN_HAND) is None
            assert hand.look().lamps == {"left_button": False, "right_button": False}
            hand._act(BUTTON, is_on=True)
            for _ in range(500):
                assert loop.tick(OPEN_HAND) is None
            assert loop.state.digital_in == 0b001
            assert loop.state.digital_out == 0b101
            hand._act(BUTTON, is_on=False)
            assert hand.saw(LAMP, is_on=True)
            assert hand.saw(LID, is_on=True)
            assert controller.fault("truth")["digital_out"] & 1 << 6 == 0  # the pulse is over
        finally:
            loop.close()


def test_pulses_and_levels_reach_their_terminals_and_a_stop_in_a_pulse_leaves_no_coil_under_current(lab):
    folder, controller = lab
    resolved = resolve(rig=folder / "rig.yaml", scenario=folder / "small.yaml")
    arm = RtdePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig, cell=resolved.cell).arm

    def tick(n, digital_out):
        """Return the terminals of lamp and lid after some ticks: lamp 0 (inverted), the coil that opens, that shuts."""
        for k in range(n):
            arm.write(
                ArmCommand(
                    stamp_ns=arm.clock.now_ns(), sequence=k, q_rad=q_rad, grip=OPEN_HAND, digital_out=digital_out
                )
            )
            arm.clock.wait_tick()
            arm.read()
        return terminals()

    def terminals():
        pins = controller.fault("truth")["digital_out"]
        return tuple(pins >> i & 1 for i in (11, 6, 8))

    try:
        arm.connect()
        arm.engage()
        q_rad = arm.read().q_rad
        assert tick(10, 0b101) == (0, 1, 0)
        assert tick(100, 0b101) == (0, 0, 0), "the pulse is over, the level stays"
        assert tick(10, 0b000) == (1, 0, 1)
        assert arm.stop()
        assert terminals() == (1, 0, 0)
        assert arm.read().digital_out == 0
    finally:
        arm.close()


def test_a_program_that_replaces_ours_in_a_pulse_leaves_no_coil_under_current(lab):
    """Whose program runs is one matter, whose coil is under current another: the outputs have a link of their own."""
    folder, controller = lab
    long_pulse = CELL.replace("pulse_s: 0.1", "pulse_s: 5.0")
    (folder / "long_cell.yaml").write_text(long_pulse)
    rig = yaml.safe_load((folder / "rig.yaml").read_text()) | {"cell": "./long_cell.yaml"}
    (folder / "long.yaml").write_text(yaml.safe_dump(rig))
    resolved = resolve(rig=folder / "long.yaml", scenario=folder / "small.yaml")
    arm = RtdePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig, cell=resolved.cell).arm

    def coil():
        return controller.fault("truth")["digital_out"] >> 6 & 1

    def write(k):
        now_ns = arm.clock.now_ns()
        arm.write(ArmCommand(stamp_ns=now_ns, sequence=k, q_rad=q_rad, grip=OPEN_HAND, digital_out=0b100))
        arm.clock.wait_tick()
        arm.read()

    try:
        arm.connect()
        arm.engage()
        q_rad = arm.read().q_rad
        for k in range(10):
            write(k)
        assert coil() == 1
        with socket.create_connection((HOST, 30002)) as somebody:
            somebody.sendall(b"def other():\n while True:\n  sync()\n end\nend\n")
            with pytest.raises(RobotError):
                all(write(k) is None for k in range(10, 1000))
            assert not arm.stop()
        assert coil() == 0
    finally:
        arm.close()
        controller.fault("program_stop")


ODD_LID = CELL.replace("pulse_s: 0.1", "pulse_s: 5.0")
SEND = b"def other():\n while True:\n  sync()\n end\nend\n"


@pytest.fixture
def walked(tmp_path):
    """A lab of its own, and somebody's walk in it that has come to the outputs."""
    host = "127.0.0.63"
    make_lab(tmp_path, host, cell=ODD_LID)
    with (
        controller_of(tmp_path, host, cell=str(tmp_path / "cell.yaml")) as controller,
        start(
            tmp_path, "cell", "test", "--rig", "rig.yaml", "--scenario", "small.yaml", stdin=subprocess.PIPE
        ) as process,
    ):
        try:
            for bits in (1 << 13, 1 << 0, 1 << 7):
                asked_for(process, "...")
                controller.fault("inputs", bits=bits)
                asked_for(process, "...")
                controller.fault("inputs", bits=0)
            asked_for(process, "Enter switches")
            yield controller, process
        finally:
            process.kill()


def asked_for(process, words):
    said = ""
    while words not in said:
        letter = process.stderr.read(1)
        assert letter, said
        said += letter
    return said


def says(process, words):
    process.stdin.write(words)
    process.stdin.flush()


def ended(process, said=""):
    """Return exit code and what was said last, answering whatever is still asked."""
    out, err = process.communicate(said, timeout=60)
    assert "Traceback" not in err
    assert "terminate called" not in err + out
    return process.returncode, err


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_in_a_lids_pulse_leaves_the_outputs_as_they_were_and_says_so(walked, number):
    controller, process = walked
    before = controller.fault("truth")["digital_out"]
    for _ in range(2):
        says(process, "\ny\ny\n")
        asked_for(process, "Enter switches")
    says(process, "\n")
    end_s = time.monotonic() + 20.0
    while not controller.fault("truth")["digital_out"] & 1 << 6:
        assert time.monotonic() < end_s
    process.send_signal(number)
    code, said = ended(process)
    assert (code, controller.fault("truth")["digital_out"]) == (128 + number, before)
    assert f"ended by {number.name}: the outputs are as they were" in said


@pytest.mark.slow
def test_a_controller_that_goes_amid_a_walk_ends_it_with_one_error_and_what_is_not_known(walked):
    controller, process = walked
    says(process, "\ny\n")
    asked_for(process, "dark now?")
    controller.__exit__(None, None, None)
    code, said = ended(process, "y\n" * 10)
    assert code == 1
    assert said.count("error: ") == 1
    assert "the link to 127.0.0.63 was lost" in said
    assert "NOT CONFIRMED that the outputs are as they were" in said


@pytest.mark.slow
def test_a_program_that_begins_amid_a_walk_ends_it_in_words_and_the_outputs_are_as_they_were(walked):
    controller, process = walked
    before = controller.fault("truth")["digital_out"]
    says(process, "\ny\n")
    asked_for(process, "dark now?")
    with socket.create_connection(("127.0.0.63", 30002), timeout=5.0) as link:
        link.sendall(SEND)
        link.recv(64)
    end_s = time.monotonic() + 20.0
    while controller.fault("truth")["runtime"] == "STOPPED":
        assert time.monotonic() < end_s
    code, said = ended(process, "y\n" * 10)
    assert (code, controller.fault("truth")["digital_out"]) == (1, before)
    assert "a word in the outputs too" in said.replace("\n", " ")
    assert "the outputs are as they were" in said


def test_the_button_that_arms_is_walked_to(lab):
    folder, _ = lab
    resolved = resolve(rig=folder / "rig.yaml", scenario=folder / "small.yaml")
    assert arming_wires(resolved.cell) == ()
    entry = CellInput(signal=9, pin="CI6", inverted=True)
    cell = msgspec.structs.replace(resolved.cell, inputs=(*resolved.cell.inputs, entry), arming_signal=9)
    (wire,) = arming_wires(cell)
    assert (wire.label, wire.inverted) == ("arming button (CI6)", True)
