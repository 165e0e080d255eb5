"""Learning on the rig virtual_lab: learner, servo process and virtual controller are three processes."""

import csv
import os
import signal
import time

import pytest

from learning.run_folder import RunFolder
from tests.support.small_lab import SERIAL, autotelic, children_of, controller_of, make_lab, start

HOST = "127.0.0.61"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    make_lab(folder, HOST)
    with controller_of(folder, HOST) as controller:
        yield folder, controller


def until(is_true, timeout_s=30.0):
    end = time.monotonic() + timeout_s
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.02)


def learn(out, *more):
    return ("learn", "--rig", "rig.yaml", "--scenario", "small.yaml", "--preset", "fast.yaml", "--out", out, *more)


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


def interrupt(lab, out, n_signals):
    """Begin a run, let it learn an epoch, and press Ctrl-C so often; return its exit code and what it said."""
    folder, controller = lab
    with start(folder, *learn(out)) as process:
        try:
            until(lambda: process.poll() is not None or epochs_of(folder / out))
            servo = children_of(process.pid)
            for _ in range(n_signals):
                os.killpg(process.pid, signal.SIGINT)
                time.sleep(0.3)
            _, said = process.communicate(timeout=40)
        finally:
            process.kill()
    assert servo, said
    until(lambda: all(is_gone(pid) for pid in servo), timeout_s=5)
    assert_at_rest(controller)
    return process.returncode, said


def test_learning_over_the_wire_is_stopped_by_ctrl_c_and_leaves_a_checkpoint_no_process_and_no_motion(lab):
    code, said = interrupt(lab, "run", 1)
    assert (code, "go on with" in said) == (130, True), said
    done = epochs_of(lab[0] / "run")
    state, _ = RunFolder(lab[0] / "run").checkpoints.newest()
    assert state["n_done"] == len(done)
    assert 1 <= len(done) < 3
    assert RunFolder(lab[0] / "run").manifest().plant == f"virtual/ur5e/{SERIAL}"


@pytest.mark.slow
def test_a_run_over_the_wire_goes_on_from_its_checkpoint_to_its_end(lab):
    folder, _ = lab
    code, said = interrupt(lab, "long", 1)
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
    code, said = interrupt(lab, "twice", 2)
    assert (code, "stopped at once" in said) == (130, True), said


def test_workers_are_refused_where_there_is_one_arm(lab):
    code, _, said = autotelic(lab[0], *learn("workers", "--workers", "1"))
    assert (code, said.count("\n")) == (2, 1)
    assert "--workers" in said
