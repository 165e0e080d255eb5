"""`autotelic up` on a small lab: each process is killed or frozen while the arm moves; the physics' joints are judged.

Times are the twin's own, slice by slice: a machine that is busy elsewhere slows it down with all else.
"""

import json
import os
import re
import signal
import time
from contextlib import suppress

import pytest

from sim_twin.controller.process import ControllerProcessError, ask_fault
from tests.support.small_lab import SCENARIO, make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.78"
ENDLESS = """\
name: endless
experiment: {epochs: 1000, trials: 1, steps: 200, evaluate_every: 500, test_epochs: 1, checkpoint_every: 1}
"""
SLICE_S, STILL_RAD_S, MOVES_RAD_S = 0.002, 0.01, 0.15
REST_S = 0.8
"""From the fault to rest: 120 ms until silence is noticed, the stop itself, and what a poll over a port takes."""
CASES = [
    (node, what)
    for node in ("learning", "robot", "perception", "twin")
    for what in ("kill", "freeze_1s", "freeze_8s", "terminate")
]  # fmt: skip


class Up:
    """A supervised lab."""

    def __init__(self, folder):
        self.folder = folder
        make_lab(folder, HOST, cell=None)
        (folder / "endless.yaml").write_text(ENDLESS)
        self.process = start(
            folder, "up", "rig.yaml", "--scenario", "small.yaml", "--out", "up", "--json", "--", "--preset",
            "endless.yaml",
        )  # fmt: skip

    def log(self):
        path = self.folder / "up" / "logs" / "supervisor.log"
        return path.read_text() if path.exists() else ""

    def pid(self, node):
        return int(re.findall(rf"{node}: started as process (\d+)", self.log())[-1])

    def truth(self):
        try:
            return ask_fault(HOST, "truth")
        except ControllerProcessError:
            return None

    def until_moving(self, timeout_s=120.0):
        end = time.monotonic() + timeout_s
        n = 0
        while n < 3:
            assert time.monotonic() < end, self.log()
            assert self.process.poll() is None, self.log()
            truth = self.truth()
            n = n + 1 if truth and max(map(abs, truth["qd_rad_s"])) > MOVES_RAD_S else 0
            time.sleep(0.02)

    def until_told(self, words, after, timeout_s=60.0):
        end = time.monotonic() + timeout_s
        while words not in self.log()[after:]:
            assert time.monotonic() < end, self.log()
            time.sleep(0.05)

    def until_recording(self, timeout_s=60.0):
        end = time.monotonic() + timeout_s
        n_bytes, grown = self.n_recorded(), 0
        while grown < 4:
            assert time.monotonic() < end
            time.sleep(0.5)
            n_before, n_bytes = n_bytes, self.n_recorded()
            grown = grown + 1 if n_bytes > n_before else 0

    def n_recorded(self):
        return sum(path.stat().st_size for path in (self.folder / "up/sessions").glob("*.mcap"))

    def end(self):
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=90)
        return self.process.returncode, json.loads(out)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    assert "goals" in SCENARIO
    made = Up(tmp_path_factory.mktemp("up"))
    yield made
    if made.process.poll() is None:
        made.process.send_signal(signal.SIGTERM)
        made.process.communicate(timeout=90)


def bring_about(what, pid):
    os.kill(pid, {"kill": signal.SIGKILL, "terminate": signal.SIGTERM}.get(what, signal.SIGSTOP))


def rests_after_s(lab, seconds):
    """Return when the arm rested, from now on, by the twin's slices; None where it cannot be seen."""
    first = lab.truth()
    if first is None:
        return None
    moved, end = first["n_slices"], time.monotonic() + seconds
    while time.monotonic() < end:
        truth = lab.truth()
        if truth is None:
            return None
        if max(map(abs, truth["qd_rad_s"])) > STILL_RAD_S:
            moved = truth["n_slices"]
        time.sleep(0.005)
    return (moved - first["n_slices"]) * SLICE_S


@pytest.mark.parametrize("what", ["kill", "freeze_1s", "freeze_8s"])
def test_an_arm_whose_recorder_fails_goes_on(lab, what):
    lab.until_moving()
    lab.until_recording()
    before, pid = lab.log(), lab.pid("recorder")
    bring_about(what, pid)
    lab.until_moving(5.0)
    if what.startswith("freeze"):
        time.sleep(float(what[7:-1]))
        with suppress(ProcessLookupError):  # one that was frozen for long was killed
            os.kill(pid, signal.SIGCONT)
    if what != "freeze_1s":
        lab.until_told("recorder: started as process", len(before))
    lab.until_moving()
    told = lab.log()[len(before) :]
    assert "arm is stopped" not in told
    assert "stop confirmed" not in told


@pytest.mark.parametrize(("node", "what"), CASES, ids=[f"{node}_{what}" for node, what in CASES])
def test_an_arm_whose_process_fails_rests_and_the_run_goes_on(lab, node, what):
    lab.until_moving()
    before, pid = lab.log(), lab.pid(node)
    bring_about(what, pid)
    if node == "learning" and what == "terminate":  # asked politely it ends its epoch first
        rested_s = 0.0
    else:
        rested_s = None if node == "twin" else rests_after_s(lab, 0.95)
    if what.startswith("freeze"):
        time.sleep(max(0.0, float(what[7:-1]) - (0.0 if node == "twin" else 0.95)))
        try:
            os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            assert what == "freeze_8s"
    with (lab.folder / "rests.txt").open("a") as rests:
        rests.write(f"{node} {what} {rested_s}\n")
    assert node == "twin" or rested_s < REST_S
    if what in ("kill", "terminate", "freeze_8s"):
        lab.until_told(f"{node}: started as process", len(before))
    lab.until_moving()
    told = lab.log()[len(before) :]
    if what in ("kill", "terminate"):
        assert f"{node}: " in told
        assert "it is started again in" in told
    if what == "freeze_8s":
        assert f"{node}: silent for 1.5 s: the arm is stopped" in told
        assert "it is killed" in told
    if node != "learning":
        assert "learning: finished" not in told


def test_ctrl_c_stops_the_arm_first_and_last_and_leaves_no_process(lab):
    lab.until_moving()
    pids = [lab.pid(node) for node in ("learning", "robot", "perception", "recorder", "twin")]
    code, summary = lab.end()
    assert code == summary["exit_code"] == 3, summary["events"][-12:]
    assert summary["stop_first_ms"] is not None
    assert summary["stop_last_ms"] is not None
    ended = [event["node"] for event in summary["events"] if "ended with exit code" in event["what"]]
    assert ended[-4:] == ["robot", "perception", "recorder", "twin"]
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    assert (lab.folder / "up" / "run" / "goals.csv").exists()
