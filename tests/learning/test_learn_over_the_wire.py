"""Learning on the rig virtual_lab: learner, servo process and virtual controller are three processes."""

import csv
import os
import re
import signal
import subprocess
import time

import numpy as np
import pytest

from config.loader import load_arm
from learning.run_folder import RunFolder
from robot.bus import RESET, Bus, ResetRequest, Role
from tests.support.small_lab import SERIAL, autotelic, children_of, controller_of, make_lab, start

pytestmark = pytest.mark.realtime

HOST = "127.0.0.61"
ENDLESS = """\
name: endless
experiment: {epochs: 1000, trials: 1, steps: 2000, evaluate_every: 50, test_epochs: 1, checkpoint_every: 1}
"""
"""Epochs of up to a minute: the second Ctrl-C comes while the one in hand at the first still is."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    make_lab(folder, HOST)
    with controller_of(folder, HOST) as controller:
        yield folder, controller


@pytest.fixture
def lab_by_person(tmp_path):
    host = "127.0.0.63"
    make_lab(tmp_path, host, reset="person")
    with controller_of(tmp_path, host) as controller:
        yield tmp_path, controller, host


def until(is_true, timeout_s=90.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.02)


def learn(out, *more, preset="fast.yaml"):
    return ("learn", "--rig", "rig.yaml", "--scenario", "small.yaml", "--preset", preset, "--out", out, *more)


def epochs_of(folder):
    if not (folder / "goals.csv").exists():
        return []
    with (folder / "goals.csv").open() as rows:
        return [int(row["epoch"]) for row in csv.DictReader(rows)]


def is_gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


def assert_at_rest(controller):
    before = controller.fault("truth")
    until(lambda: controller.fault("truth")["n_slices"] > before["n_slices"] + 100)
    after = controller.fault("truth")
    assert after["runtime"] == "STOPPED"
    assert max(abs(a - b) for a, b in zip(after["q_rad"], before["q_rad"], strict=True)) < 1e-3
    assert max(map(abs, after["qd_rad_s"])) < 5e-3


def interrupt(lab, out):
    """Begin a run, let it learn an epoch, and press Ctrl-C; return its exit code and what it said."""
    folder, controller = lab
    with start(folder, *learn(out)) as process:
        try:
            until(lambda: process.poll() is not None or epochs_of(folder / out))
            servo = children_of(process.pid)
            os.killpg(process.pid, signal.SIGINT)
            _, said = process.communicate(timeout=40)
        finally:
            process.kill()
    assert servo, said
    assert_over(controller, servo)
    return process.returncode, said


def assert_over(controller, servo):
    until(lambda: all(is_gone(pid) for pid in servo), timeout_s=5)
    assert_at_rest(controller)


def test_learning_over_the_wire_is_stopped_by_ctrl_c_and_leaves_a_checkpoint_no_process_and_no_motion(lab):
    code, said = interrupt(lab, "run")
    assert (code, "go on with" in said) == (130, True), said
    done = epochs_of(lab[0] / "run")
    state, _ = RunFolder(lab[0] / "run").checkpoints.newest()
    assert state["n_done"] == len(done)
    assert 1 <= len(done) < 3
    assert RunFolder(lab[0] / "run").manifest().plant == f"virtual/ur5e/{SERIAL}"


@pytest.mark.slow
def test_a_run_over_the_wire_goes_on_from_its_checkpoint_to_its_end(lab):
    folder, _ = lab
    code, said = interrupt(lab, "long")
    assert code == 130, said
    before = (folder / "long/trials.csv").read_text()
    code, out, said = autotelic(folder, *learn("long", "--resume", "--json"), timeout_s=120)
    assert code == 0, said
    assert (folder / "long/trials.csv").read_text().startswith(before)
    assert epochs_of(folder / "long") == [0, 1, 2]
    assert '"n_epochs":3' in out.replace(" ", "")
    assert_at_rest(lab[1])


@pytest.mark.slow
def test_a_second_ctrl_c_ends_it_at_once(lab):
    folder, controller = lab
    (folder / "endless.yaml").write_text(ENDLESS)
    with start(folder, *learn("twice", preset="endless.yaml")) as process:
        try:
            until(lambda: process.poll() is not None or max(map(abs, controller.fault("truth")["qd_rad_s"])) > 0.1)
            servo = children_of(process.pid)
            os.killpg(process.pid, signal.SIGINT)
            said = [next(line for line in process.stderr if "stopping after this epoch" in line)]
            os.killpg(process.pid, signal.SIGINT)
            said += process.stderr
            process.wait(timeout=40)
        finally:
            process.kill()
    assert servo, said
    assert (process.returncode, "stopped at once" in "".join(said)) == (130, True), said
    assert_over(controller, servo)


@pytest.mark.slow
def test_a_run_outlives_a_protective_stop_as_the_virtual_tables_reset_unlocks_it(lab):
    folder, controller = lab
    with start(folder, *learn("stopped")) as process:
        try:
            until(lambda: process.poll() is not None or epochs_of(folder / "stopped"))
            until(lambda: controller.fault("truth")["runtime"] == "PLAYING")
            controller.fault("protective_stop")
            _, said = process.communicate(timeout=70)
        finally:
            process.kill()
    assert process.returncode == 0, said
    assert epochs_of(folder / "stopped") == [0, 1, 2]
    with (folder / "stopped" / "goals.csv").open() as rows:
        assert sum(int(row["is_void"]) for row in csv.DictReader(rows)) <= 1
    assert_at_rest(controller)


@pytest.mark.slow
def test_a_run_outlives_programs_that_are_stopped_at_any_moment_of_an_epoch_or_a_reset(lab):
    folder, controller = lab
    n_stops = 0
    with start(folder, *learn("interrupted")) as process:
        try:
            until(lambda: process.poll() is not None or epochs_of(folder / "interrupted"), timeout_s=90)
            while process.poll() is None and n_stops < 12:
                if controller.fault("truth")["runtime"] == "PLAYING":
                    controller.fault("program_stop")
                    n_stops += 1
                time.sleep(0.23)
            _, said = process.communicate(timeout=120)
        finally:
            process.kill()
    assert process.returncode == 0, said
    assert n_stops > 1
    assert epochs_of(folder / "interrupted") == [0, 1, 2]
    assert_at_rest(controller)


def test_workers_are_refused_where_there_is_one_arm(lab):
    code, _, said = autotelic(lab[0], *learn("workers", "--workers", "1"))
    assert (code, said.count("\n")) == (2, 1)
    assert "--workers" in said


@pytest.mark.slow
def test_a_person_lays_the_table_out_while_the_arm_is_parked_and_disarmed(lab_by_person):
    folder, controller, host = lab_by_person
    home = np.array(load_arm("ur5e").home_rad)
    process = start(folder, *learn("run", "--epochs", "1"), stdin=subprocess.PIPE)
    bus = Bus(f"tcp/{host}:7447", serial=SERIAL, role=Role.LEARNING, source="hand")
    bus.open()
    said, parked_rad = [], []
    try:
        for line in process.stderr:
            said.append(line)
            if "Enter" not in line:
                continue
            asked = re.search(r"epoch (\d+), seed (\d+), as in (\S+);", line)
            if asked:
                truth = controller.fault("truth")
                assert truth["runtime"] == "STOPPED", "a person reaches in: nobody may be in command"
                parked_rad.append(np.abs(np.array(truth["q_rad"]) - home).max())
                assert (folder / asked[3]).read_bytes()[:4] == b"\x89PNG"
                last = asked
            elif "put right" in line:
                bus.asker(RESET).ask(ResetRequest(seed=int(last[2]), epoch=int(last[1]), digital_out=0))
                time.sleep(0.1)
            process.stdin.write("\n")
            process.stdin.flush()
        code = process.wait(timeout=20)
    finally:
        process.kill()
        process.communicate()
        bus.close()
    text = "".join(said)
    assert code == 0, text
    assert "robot-hours: at most" in text
    assert "resets by a person: 3, of which 2 for evaluations" in text
    assert len(re.findall(r"not in place: \w+: \d+ mm off", text)) >= 3
    assert len(parked_rad) == 3
    assert max(parked_rad) < 0.02
    assert len(list((folder / "run" / "resets").glob("*.png"))) == 3
    assert_at_rest(controller)
