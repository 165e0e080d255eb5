"""What led to a stop of an arm on a wire is kept tick by tick, and what a killed servo process saw last is kept too."""

import os
import signal
import time
from itertools import pairwise
from statistics import median

import pytest

from robot.bus.topics import ARM_STATE, PERCEPT, REQUESTED, SENT, STOP
from robot.recording.checking import check
from robot.recording.session_file import SessionFile
from tests.support.small_lab import autotelic, children_of, make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.87"
LONG = """\
name: long
experiment: {epochs: 60, trials: 1, steps: 30, evaluate_every: 500, test_epochs: 1, checkpoint_every: 1}
"""
S = 1_000_000_000
STEPS = "bus/station/step"


def until(is_so, timeout_s=120.0):
    end_s = time.monotonic() + timeout_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.05)


def servo_of(process):
    """Return the process that holds the arm: the one that the robot node has started."""
    for child in children_of(process.pid):
        with open(f"/proc/{child}/cmdline", encoding="utf-8") as opened:
            if "robot" in opened.read().split("\0"):
                return max(children_of(child))
    raise AssertionError("there is no robot node")


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Let a small lab run, say stop, and later kill its servo process; return its sessions and when that was."""
    folder = tmp_path_factory.mktemp("flight")
    make_lab(folder, HOST, cell=None)
    (folder / "long.yaml").write_text(LONG)
    process = start(folder, "up", "rig.yaml", "--scenario", "small.yaml", "--out", "up", "--", "--preset", "long.yaml")
    goals = folder / "up/run/goals.csv"

    def n_done():
        return len(goals.read_text().splitlines()) - 1 if goals.exists() else 0

    try:
        until(lambda: n_done() >= 3)
        time.sleep(0.7)
        said_ns = time.monotonic_ns()
        code, _, err = autotelic(folder, "bus", "stop", "--rig", "rig.yaml")
        assert code == 0, err
        begun = n_done()
        until(lambda: n_done() >= begun + 3)
        time.sleep(0.7)
        killed_ns = time.monotonic_ns()
        os.kill(servo_of(process), signal.SIGKILL)
        begun = n_done()
        until(lambda: n_done() >= begun + 2)
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=120)
    return sorted((folder / "up/sessions").glob("stops/*.mcap")), said_ns, killed_ns


def of_the_stop(paths, at_ns, within_s):
    """Return the file of the stop that was at some time."""
    for path in paths:
        with SessionFile(path) as session:
            if -0.1 * S < int(session.about["stop_ns"]) - at_ns < within_s * S:
                return path
    raise AssertionError("no file is of that stop")


def test_what_led_to_a_stop_is_kept_tick_by_tick_up_to_it(stopped):
    paths, said_ns, _ = stopped
    with SessionFile(of_the_stop(paths, said_ns, 10.0)) as session:
        assert any(True for _ in session.raw([STOP.name]))
        stamps = [raw.log_ns for raw in session.raw([ARM_STATE.name])]
        n_asked = sum(1 for _ in session.raw([REQUESTED.name]))
    assert median(b - a for a, b in pairwise(stamps)) == pytest.approx(2e6, abs=4e5)
    assert len(stamps) > 500
    assert n_asked > 0.9 * len(stamps)


def test_what_a_killed_servo_process_saw_last_is_kept(stopped):
    paths, _, killed_ns = stopped
    with SessionFile(of_the_stop(paths, killed_ns, 5.0)) as session:
        ticks, steps = ([r.log_ns for r in session.raw([name]) if r.log_ns <= killed_ns] for name in (SENT.name, STEPS))
    assert ticks[-1] > steps[-1] - 0.05 * S, "every time step that was answered has its ticks"


def test_the_doctor_finds_nothing_lost_in_it(stopped):
    paths, said_ns, _ = stopped
    with SessionFile(of_the_stop(paths, said_ns, 10.0)) as session:
        wrong = [f for f in check(session).findings if f.severity == "error" and f.topic != PERCEPT.name]
    assert {f.kind for f in wrong} <= {"gap", "lost messages"}, wrong
