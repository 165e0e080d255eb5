"""`autotelic controller` as a process, and its faults from another."""

import math
import re
import signal
import socket
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from sim_twin.controller.cli import app
from sim_twin.controller.control_port import CONTROL
from sim_twin.controller.process import ControllerProcess, ControllerProcessError, ask_fault
from sim_twin.controller.server import Setup
from sim_twin.controller.wire.wires import DASHBOARD

pytestmark = pytest.mark.realtime

HOST = "127.0.0.9"
RUN = [sys.executable, "-c", "from sim_twin.controller.cli import app; app()"]


@pytest.fixture(scope="module")
def process():
    with ControllerProcess(Setup(host=HOST)) as opened:
        yield opened


def said(host, *asked):
    """Return the dashboard's answers, its greeting left out."""
    with socket.create_connection((host, DASHBOARD), timeout=5.0) as connection:
        heard = connection.makefile("rb")
        connection.sendall("".join(f"{line}\n" for line in asked).encode())
        return [heard.readline().decode().strip() for _ in range(len(asked) + 1)][1:]


def test_a_controller_says_that_it_is_ready_and_ends_cleanly(tmp_path):
    script = tmp_path / "a.script"
    script.write_text("def f():\n set_digital_out(2, True)\nend\n")
    shelved = tmp_path / "b.script"
    shelved.write_text("def g():\n set_digital_out(3, True)\nend\n")
    command = [*RUN, "--host", "127.0.0.10", "--version", "5.23.0", "--script", str(script), "--program", str(shelved)]
    command += ["--plane", "0,0,1,0.01", "--plane", "-1,0,0,-2", "--safety-input", "safeguard=CI2"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout.readline() == "virtual UR5e 5.23.0 ready on 127.0.0.10\n"
        time.sleep(0.3)
        assert ask_fault("127.0.0.10", "truth")["digital_out"] == 1 << 2
        assert said("127.0.0.10", "load a.script", "load b.script", "play") == [
            "File not found: a.script", "Loading program: b.script", "Starting program",
        ]  # fmt: skip
        time.sleep(0.3)
        assert ask_fault("127.0.0.10", "truth")["digital_out"] == 1 << 2 | 1 << 3
        assert "refusal" not in ask_fault("127.0.0.10", "terminal", name="safeguard")
        assert ask_fault("127.0.0.10", "truth")["safety_mode"] == "SAFEGUARD_STOP"
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=10)
    assert running.returncode == 0, err
    assert out == "stopped\n"
    assert not err


@pytest.mark.parametrize("plane", ["0,0,1", "a,b,c,d", "0,0,0,0.1", "0,0,1,inf", ""])
def test_a_plane_that_is_none_is_refused_in_one_line(plane):
    result = CliRunner().invoke(app, ["--host", "127.0.0.10", "--plane", plane])
    assert result.exit_code == 2
    assert result.output.startswith("error: plane: expected")
    assert result.output.count("\n") == 1


def test_a_safety_input_that_is_none_is_refused_in_one_line():
    result = CliRunner().invoke(app, ["--host", "127.0.0.10", "--safety-input", "door=CI0"])
    assert result.exit_code == 2
    assert result.output.startswith("error: safety input: expected")
    assert result.output.count("\n") == 1


def test_an_address_that_others_can_reach_is_refused():
    result = CliRunner().invoke(app, ["--host", "0.0.0.0"])
    assert result.exit_code == 2
    assert "--allow-any" in result.output


def test_a_second_controller_on_one_address_is_refused(process):
    with pytest.raises(ControllerProcessError, match="listen"), ControllerProcess(Setup(host=HOST)):
        pass


def test_faults_come_by_the_command_line(process):
    result = CliRunner().invoke(app, ["fault", HOST, "protective_stop"])
    assert result.exit_code == 0, result.output
    assert process.fault("truth")["safety_mode"] == "PROTECTIVE_STOP"
    assert CliRunner().invoke(app, ["fault", HOST, "nonsense"]).exit_code == 1
    assert CliRunner().invoke(app, ["fault", HOST, "delay", "ms=x"]).exit_code == 1
    assert CliRunner().invoke(app, ["fault", HOST, "delay", "ms=3x"]).exit_code == 2
    assert CliRunner().invoke(app, ["fault", HOST, "delay", "ms"]).exit_code == 2
    assert CliRunner().invoke(app, ["fault", HOST, "truth", "name=1"]).exit_code == 1
    assert CliRunner().invoke(app, ["fault", "127.0.0.11", "truth"]).exit_code == 1


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        *[("delay", {"port": 1}), ("delay", {"ms": 1e9}), ("delay", {"ms": "5"}), ("late", {"ms": -1})],
        *[("late", {"every": 1.5}), ("bias", {"rad": [1]}), ("bias", {"rad": [1e9] * 6}), ("drop", {"no": 1})],
        *[
            ("drop", {"port": [1]}),
            ("push", {"nm": "x"}),
            ("push", {"nm": [1e9, 0, 0, 0, 0, 0]}),
            ("push", {"nm": [1]}),
        ],
        *[
            ("inputs", {"bits": 1.5}),
            ("inputs", {"bits": "x"}),
            ("inputs", {"bits": -1}),
            ("inputs", {"bits": 1 << 18}),
        ],
        *[("noise", {"rad": "x"}), ("noise", {"rad": -1}), ("payload", {"kg": "x"}), ("payload", {"kg": -1})],
        *[
            ("calibrate", {"mm": 1e9}),
            ("calibrate", {"mrad": "x"}),
            ("jog", {}),
            ("jog", {"rad": [0, 0, 0, 0, 0, 1e6]}),
        ],
        *[("reserve", {"names": 3}), ("reserve", {"names": [[1]]}), ("reserve", {"names": ["no_such_field"]})],
        *[("remote", {"on": "no"}), ("reduced", {"on": 3}), ("log", {"last": "x"}), ("log", {"last": 0})],
        *[("ticks", {"clear": "x"}), ("truth", {"self": 1}), ("estop", {"on": True}), ("freeze", {"port": "30004"})],
    ],
)
def test_a_fault_that_makes_no_sense_is_refused(process, name, numbers):
    with pytest.raises(ControllerProcessError, match=name):
        process.fault(name, **numbers)
    assert process.is_alive


@pytest.mark.parametrize("line", [b"[" * 60_000, b'{"fault": ' + b'{"a": ' * 9_000, b"\xff", b'{"fault": ["x"]}', b"1"])
def test_a_line_that_is_no_fault_is_answered_with_an_error(process, line):
    with socket.create_connection((HOST, CONTROL), timeout=5.0) as connection:
        connection.sendall(line + b"\n")
        assert b'"error"' in connection.makefile("rb").readline()
    assert process.is_alive


def test_the_greatest_faults_leave_the_controller_alive(process):
    process.fault("calibrate", mm=100.0, mrad=100.0)
    process.fault("inputs", bits=(1 << 18) - 1)
    process.fault("noise", rad=0.5)
    process.fault("push", nm=[300.0, -300.0, 300.0, 300.0, 300.0, 300.0])
    time.sleep(0.2)
    truth = process.fault("truth")
    for name in ("calibrate", "inputs", "noise", "push"):
        process.fault(name)
    assert all(math.isfinite(q) for q in truth["q_rad"])
    before = truth["n_slices"]
    time.sleep(0.05)
    assert process.fault("truth")["n_slices"] > before


def test_a_faults_argument_may_be_a_word_for_shells_eat_quotes(process):
    told = CliRunner().invoke(app, ["fault", HOST, "terminal", "name=reduced"])
    assert "reduced" in told.stderr
    assert "arguments" not in told.stderr


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("port=30004x", "arguments: port: expected a number, true, false, a list in brackets or a word, got '30004x'"),
        ("rad=[0,", "arguments: rad: expected a number, true, false, a list in brackets or a word, got '[0,'"),
        ("port", "arguments: expected name=value, got 'port'"),
    ],
)
def test_a_faults_wrong_argument_is_told_by_name_with_what_came_and_what_was_expected(given, words):
    result = CliRunner().invoke(app, ["fault", HOST, "drop", given])
    assert result.exit_code == 2
    assert words in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--version", "4294967296.1.1"], "version: expected"),
        (["--version", "5.4294967296.1"], "version: expected"),
        (["--version", "7.1.1"], "version: expected 3.x (CB3) or 5.x (e-Series)"),
        (["--version", "10.7.0"], "PolyScope X"),
        (["--version", "5.x"], "version: expected numbers"),
        (["--bus", "nonsense"], "bus: expected an endpoint such as tcp/"),
        (["--bus", 'tcp/"]'], "bus: expected"),
        (["--host", "nonsense"], "nonsense"),
        (["--scenario", "nonsense"], "scenarios: expected"),
        (["--cell", "nonsense"], "cells: expected"),
        (["--script", "/nonsense"], "/nonsense"),
        (["--program", "/absent"], "/absent"),
    ],
)
def test_a_wrong_argument_is_told_in_one_line(arguments, words):
    result = CliRunner().invoke(app, ["--host", "127.0.0.66", *arguments])
    assert (result.exit_code, result.output.count("\n")) == (2, 1), result.output
    assert words in result.output


def test_everything_can_stand_still_and_go_on(process):
    process.fault("freeze_all", on=True)
    frozen = process.fault("truth")["n_slices"]
    time.sleep(0.05)
    assert process.fault("truth")["n_slices"] == frozen
    process.fault("freeze_all", on=False)
    time.sleep(0.05)
    assert process.fault("truth")["n_slices"] > frozen


def test_late_slices_are_skipped_and_not_caught_up(process):
    before = process.fault("ticks")["n_missed"]
    process.fault("late", ms=20.0, every=10)
    time.sleep(0.3)
    process.fault("late")
    assert process.fault("ticks")["n_missed"] - before > 30


def refused(*words):
    """Return the one line that a controller says which does not start with these words."""
    came = CliRunner().invoke(app, list(map(str, words)))
    assert came.exit_code == 2, came.output
    assert came.output.count("\n") == 1
    return came.output


def test_what_names_the_same_twice_or_is_no_program_starts_nothing_and_is_named(tmp_path):
    for name, text in (("a/p.script", b"def f():\n sync()\nend\n"), ("b/p.script", b"def g():\n sync()\nend\n")):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes(text)
    empty, latin = tmp_path / "empty.script", tmp_path / "latin.script"
    empty.write_text("  \n")
    latin.write_bytes(b'def f():\n textmsg("\xe9")\nend\n')
    twice = refused("--program", tmp_path / "a/p.script", "--program", tmp_path / "b/p.script")
    assert "'p.script' twice" in twice
    assert "'safeguard' twice" in refused("--safety-input", "safeguard=CI2", "--safety-input", "safeguard=CI4")
    assert f"{empty}: expected a program, the file is empty" in refused("--script", empty)
    assert f"{latin}: expected a program in UTF-8" in refused("--script", latin)
    assert "expected a robot with power for --script" in refused("--script", tmp_path / "a/p.script", "--unpowered")
    assert "expected an IP address" in refused("--host", "localhost")


def test_a_script_that_fails_as_it_runs_is_told_at_the_terminal(tmp_path):
    script = tmp_path / "a.script"
    script.write_text("def f():\n sync()\n x = [1, 2]\n y = x[7]\nend\n")
    command = [*RUN, "--host", "127.0.0.11", "--script", str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert "ready" in running.stdout.readline()
        time.sleep(0.5)
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=10)
    assert re.search(r"line 4|index", err), err
