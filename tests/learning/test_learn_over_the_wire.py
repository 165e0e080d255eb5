"""Learning on the rig virtual_lab: learner, servo process and virtual controller are three processes."""

import csv
import os
import re
import signal
import subprocess
import time
from threading import Event

import pytest

from learning.run_folder import RunFolder
from tests.support.person_at_arm import attended
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
    make_lab(tmp_path, host, reset="person", operator="robot.person:PersonOperator")
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
def test_a_person_at_the_robot_nodes_terminal_arms_and_lays_the_table_out_while_the_arm_is_parked(lab_by_person):
    folder, controller, _ = lab_by_person
    with attended(*lab_by_person[:2]) as (person, _):
        code, _, said = autotelic(folder, *learn("run", "--epochs", "1"), timeout_s=240, said="\n")
    text = "".join(person.said)
    assert code == 0, said + text
    assert "robot-hours: at most" in said
    assert "resets by a person: 3, of which 2 for evaluations" in said
    assert "the robot node waits for a person at the arm: to arm it" in said
    assert "the robot node waits for a person at the arm: to lay the table out" in said
    assert len(re.findall(r"not in place: \w+: \d+ mm off", text)) >= 3
    assert len(person.parked_rad) == 3
    assert max(person.parked_rad) < 0.02
    assert len(list((folder / "resets").glob("*.png"))) == 3
    assert_at_rest(controller)


@pytest.mark.slow
def test_who_has_died_is_waited_for_no_longer_and_the_next_one_is_asked_for_anew(lab_by_person):
    folder, controller, _ = lab_by_person
    with attended(*lab_by_person[:2]) as (person, _):
        answer, is_there = person.answer, Event()
        is_there.set()

        def late(line):
            typed = answer(line)
            if "lay the table out" in line:
                is_there.wait()
            return typed

        person.answer = late
        is_there.clear()
        with start(folder, *learn("died", "--epochs", "1"), stdin=subprocess.PIPE) as process:
            process.stdin.write("\n")
            process.stdin.flush()
            until(lambda: any("lay the table out" in line for line in person.said))
            os.killpg(process.pid, signal.SIGKILL)
        n = len(person.said)
        time.sleep(3.0)
        is_there.set()
        code, _, said = autotelic(folder, *learn("next", "--epochs", "1"), timeout_s=240, said="\n")
    assert code == 0, said + "".join(person.said)
    assert any("stand clear" in line for line in person.said[n:]), "he is asked to arm it for the next one"
    assert_at_rest(controller)


@pytest.mark.slow
def test_without_a_robot_node_nobody_lays_the_table_out_and_it_is_said_what_to_start(lab_by_person):
    folder, controller, _ = lab_by_person
    code, _, said = autotelic(folder, *learn("alone", "--epochs", "1"), said="\n")
    assert (code, said.strip().splitlines()[-1].startswith("error: rig small_lab: expected a robot node")) == (2, True)
    assert "autotelic node robot" in said
    assert_at_rest(controller)


@pytest.mark.slow
def test_without_a_hub_it_is_said_what_to_start(tmp_path):
    make_lab(tmp_path, "127.0.0.64", reset="person", operator="robot.person:PersonOperator")
    code, _, said = autotelic(tmp_path, *learn("alone", "--epochs", "1"), said="\n")
    assert code == 1, said
    assert "expected a hub at" in said.strip().splitlines()[-1]
    assert "autotelic up" in said
