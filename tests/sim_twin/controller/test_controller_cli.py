"""`autotelic controller` as a process, and its faults from another."""

import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from sim_twin.controller.cli import app
from sim_twin.controller.process import ControllerProcess, ControllerProcessError, ask_fault
from sim_twin.controller.server import Setup

HOST = "127.0.0.9"
RUN = [sys.executable, "-c", "from sim_twin.controller.cli import app; app()"]


@pytest.fixture(scope="module")
def process():
    with ControllerProcess(Setup(host=HOST)) as opened:
        yield opened


def test_a_controller_says_that_it_is_ready_and_ends_cleanly(tmp_path):
    script = tmp_path / "a.script"
    script.write_text("def f():\n set_digital_out(2, True)\nend\n")
    command = [*RUN, "--host", "127.0.0.10", "--version", "5.23.0", "--script", str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout.readline() == "virtual UR5e 5.23.0 ready on 127.0.0.10\n"
        time.sleep(0.3)
        assert ask_fault("127.0.0.10", "truth")["digital_out"] == 1 << 2
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=10)
    assert running.returncode == 0, err
    assert out == "stopped\n"
    assert not err


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
    assert CliRunner().invoke(app, ["fault", "127.0.0.11", "truth"]).exit_code == 1


@pytest.mark.parametrize(
    ("name", "numbers"),
    [("delay", {"port": 1}), ("late", {"ms": -1}), ("bias", {"rad": [1]}), ("drop", {"no": 1}), ("push", {"nm": "x"})],
)
def test_a_fault_that_makes_no_sense_is_refused(process, name, numbers):
    with pytest.raises(ControllerProcessError, match=name):
        process.fault(name, **numbers)


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
