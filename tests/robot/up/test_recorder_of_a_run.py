"""`autotelic up` records: what a killed recorder leaves is lived through again to the same learner, bit for bit."""

import json
import os
import re
import signal
import time

import pytest

from learning.fingerprint import fingerprint
from learning.replaying import replay_to_learning
from learning.run_folder import RunFolder
from robot.bus.topics import ARM_STATE, PERCEPT, REQUESTED, SENT, TRUTH, VERDICT
from robot.messages import Outcome
from robot.recording.cutting import merge
from robot.recording.recovering import recover
from robot.recording.session_file import SessionFile
from tests.support.small_lab import make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.79"
EIGHT = """\
name: eight
experiment: {epochs: 8, trials: 1, steps: 30, evaluate_every: 500, test_epochs: 1, checkpoint_every: 1}
"""
LOST_NS = 1_000_000_000


def until(is_so, timeout_s=120.0):
    end_s = time.monotonic() + timeout_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.05)


def run_with_a_killed_recorder(folder):
    """Run eight epochs, kill the recorder in one of them, and return when that was and what was said."""
    make_lab(folder, HOST, cell=None)
    (folder / "eight.yaml").write_text(EIGHT)
    process = start(
        folder, "up", "rig.yaml", "--scenario", "small.yaml", "--out", "up", "--json", "--night",
        "--hours", "0.1", "--",
        "--preset", "eight.yaml",
    )  # fmt: skip
    log, goals = folder / "up/logs/supervisor.log", folder / "up/run/goals.csv"
    try:
        until(lambda: goals.exists() and len(goals.read_text().splitlines()) >= 3)
        time.sleep(1.0)  # into an epoch
        pid = int(re.findall(r"recorder: started as process (\d+)", log.read_text())[-1])
        os.kill(pid, signal.SIGKILL)
        killed_ns = time.monotonic_ns()
        out, err = process.communicate(timeout=300)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
    assert process.returncode == 3, err[-2000:]
    assert json.loads(out)["stop_last_ms"] is not None
    return killed_ns, log.read_text()


def recovered(folder):
    """Return the files with an opening, and those that go on with an account, each made whole."""
    opened, continued = [], []
    for path in sorted((folder / "up/sessions").glob("*.mcap")):
        whole = folder / path.name
        recover(path, whole)
        with SessionFile(whole) as session:
            about = session.about
        if about["purpose"] == "learn":
            opened.append(whole)
        elif "continues" in about:
            continued.append(whole)
    return opened, continued


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("up")
    killed_ns, said = run_with_a_killed_recorder(folder)
    return folder, killed_ns, said, *recovered(folder)


def test_the_arm_goes_on_without_its_recorder_which_is_started_again(run):
    _, _, said, _, _ = run
    assert "recorder: killed by signal 9" in said
    assert "arm is stopped" not in said


def test_a_run_that_nobody_attended_leaves_a_report(run):
    told = (run[0] / "up/morning.md").read_text()
    assert told.startswith("# small_lab: 0.0 h, something went wrong and was mended\n")
    assert "* stops: " in told  # a stop at the end latches too
    assert "| recorder | 2 |" in told


def test_a_killed_recorder_loses_a_second_at_most_of_what_all_processes_wrote(run):
    _, killed_ns, _, opened, _ = run
    with SessionFile(opened[0]) as session:
        last_ns = max(raw.log_ns for raw in session.raw())
        n = {t.name: [m for _, _, m in session.messages(t)] for t in (ARM_STATE, REQUESTED, SENT, VERDICT, TRUTH)}
        n_percepts = sum(1 for _ in session.messages(PERCEPT))
    assert 0 <= killed_ns - last_ns < LOST_NS
    assert all(n.values())
    assert len(n[REQUESTED.name]) > 1.5 * n_percepts
    assert {verdict.outcome for verdict in n[VERDICT.name]} >= {Outcome.PASSED}


def test_what_it_left_goes_on_in_the_next_file_and_is_replayed_across_the_kill(run):
    folder, _, _, opened, continued = run
    gone_on = folder / "gone_on"
    merge([opened[0], *continued], gone_on)
    first, _ = replay_to_learning(gone_on)
    assert (first.diverged, first.is_identical) == ("", True)
    with SessionFile(opened[-1]) as session:
        assert int(session.about["n_done"]) <= first.n_done


def test_the_last_file_is_replayed_to_the_learner_that_the_run_kept(run):
    folder, _, _, opened, _ = run
    state, _ = RunFolder(folder / "up/run").checkpoints.newest()
    last, agent = replay_to_learning(opened[-1])
    assert (last.diverged, last.is_identical, last.n_done) == ("", True, 8)
    assert fingerprint(agent.state_dict()) == fingerprint(state["agent"])
