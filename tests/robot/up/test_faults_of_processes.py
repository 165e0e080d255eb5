"""`autotelic up` on a small lab: each process is killed or frozen while the arm moves; the physics' joints are judged.

Times are the twin's own, slice by slice: a machine that is busy elsewhere slows it down with all else. `make faults`
prints what came of each as a table, the link's faults beside them.
"""

import json
import os
import re
import signal
import time
from contextlib import suppress

import pytest

from sim_twin.controller.process import ControllerProcessError, ask_fault
from tests.support.fault_table import note_fault
from tests.support.small_lab import SCENARIO, make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST, SEEN_HOST = "127.0.0.78", "127.0.0.86"
ENDLESS = """\
name: endless
experiment: {epochs: 1000, trials: 1, steps: 200, evaluate_every: 500, test_epochs: 1, checkpoint_every: 1,
  void_limit: 500}
"""
SLICE_S, STILL_RAD_S, MOVES_RAD_S = 0.002, 0.01, 0.15
REST_S, SEEN_REST_S = 0.8, 1.4
"""From the fault to rest: 120 ms until silence is noticed, the stop itself, and what a poll over a port takes."""
FAULTS = ("kill", "freeze_1s", "freeze_30s", "terminate")
CASES = [(node, what) for node in ("learning", "robot", "perception", "twin") for what in FAULTS]


class Up:
    """A supervised lab.

    Args:
        folder: for its files.
        host: its controller's address.
        scenario: its table.
        rig: a shipped one, at that address.
    """

    def __init__(self, folder, host=HOST, *, scenario="small.yaml", rig="virtual_lab"):
        self.folder, self.host = folder, host
        make_lab(folder, host, rig=rig, cell=None, max_latches=10_000)
        (folder / "endless.yaml").write_text(ENDLESS)
        self.process = start(
            folder, "up", "rig.yaml", "--scenario", scenario, "--out", "up", "--json", "--", "--preset", "endless.yaml"
        )

    def log(self):
        path = self.folder / "up" / "logs" / "supervisor.log"
        return path.read_text() if path.exists() else ""

    def pid(self, node):
        return int(re.findall(rf"{node}: started as process (\d+)", self.log())[-1])

    def truth(self):
        try:
            return ask_fault(self.host, "truth")
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


def thaw(what, pid, *, frozen_s=0.0):
    """Have a process that was frozen go on when its time is over; one that was killed meanwhile is not waited for."""
    if not what.startswith("freeze"):
        return
    end_s = time.monotonic() + float(what[7:-1]) - frozen_s
    while time.monotonic() < end_s:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            break
        time.sleep(0.02)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGCONT)


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


@pytest.mark.parametrize("what", FAULTS)
def test_an_arm_whose_recorder_fails_goes_on(lab, what):
    lab.until_moving()
    lab.until_recording()
    before, pid = lab.log(), lab.pid("recorder")
    bring_about(what, pid)
    lab.until_moving(5.0)
    thaw(what, pid)
    if what != "freeze_1s":
        lab.until_told("recorder: started as process", len(before))
    lab.until_moving()
    told = lab.log()[len(before) :]
    assert "arm is stopped" not in told
    assert "stop confirmed" not in told
    note_fault("recorder", what, "the arm goes on")


@pytest.mark.parametrize(("node", "what"), CASES, ids=[f"{node}_{what}" for node, what in CASES])
def test_an_arm_whose_process_fails_rests_and_the_run_goes_on(lab, node, what):
    lab.until_moving()
    before, pid = lab.log(), lab.pid(node)
    bring_about(what, pid)
    if node == "learning" and what == "terminate":  # asked politely it ends its epoch first
        rested_s = 0.0
    else:
        rested_s = None if node == "twin" else rests_after_s(lab, 0.95)
    thaw(what, pid, frozen_s=0.0 if node == "twin" else 0.95)
    assert node == "twin" or rested_s < REST_S
    if what in ("kill", "terminate", "freeze_30s"):
        lab.until_told(f"{node}: started as process", len(before))
    lab.until_moving()
    told = lab.log()[len(before) :]
    if what in ("kill", "terminate"):
        assert f"{node}: " in told
        assert "it is started again in" in told
    if what == "freeze_30s":
        assert f"{node}: silent for 1.5 s: the arm is stopped" in told
        assert "it is killed" in told
    if node != "learning":
        assert "learning: finished" not in told
    asked = node == "learning" and what == "terminate"
    rest = "its epoch ends first" if asked else "the world ends or stands" if node == "twin" else f"{rested_s:.2f} s"
    note_fault(node, what, f"rest: {rest}; goes on")


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


@pytest.fixture(scope="module")
def seen_lab(tmp_path_factory):
    if os.environ.get("MUJOCO_GL") not in ("egl", "osmesa"):
        pytest.skip("needs MUJOCO_GL=egl or osmesa, for its camera is drawn")
    made = Up(tmp_path_factory.mktemp("seen"), SEEN_HOST, scenario="paper", rig="virtual_lab_camera")
    yield made
    if made.process.poll() is None:
        made.process.send_signal(signal.SIGTERM)
        made.process.communicate(timeout=90)


@pytest.mark.parametrize("what", FAULTS)
def test_an_arm_whose_camera_fails_rests_and_the_run_goes_on(seen_lab, what):
    """One picture that is 600 ms old stops the arm; the supervisor sees an end at once."""
    seen_lab.until_moving()
    before, pid = seen_lab.log(), seen_lab.pid("camera")
    bring_about(what, pid)
    rested_s = rests_after_s(seen_lab, 0.95 if what == "freeze_1s" else 3.0)
    thaw(what, pid, frozen_s=0.95 if what == "freeze_1s" else 3.0)
    if what != "freeze_1s":
        assert rested_s < SEEN_REST_S
        seen_lab.until_told("camera: started as process", len(before))
    seen_lab.until_moving()
    told = seen_lab.log()[len(before) :]
    assert "given up" not in told
    note_fault("camera", what, f"last motion seen after {rested_s:.2f} s; goes on")
