"""A learner on another machine, and what the cable between does: the arm rests where it must, and the run goes on.

The arm's machine and the learner's are network namespaces, the bus is over TLS, and each packet passes an emulator of
ours. Joints are the twin's own, slice by slice. Both ends have one clock here; tests of admission judge two.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sim_twin.controller.process import ControllerProcessError, ask_fault
from tests.support.fault_table import note_fault
from tests.support.netns import EmulatedCable, inside, why_not
from tests.support.small_lab import autotelic, make_lab

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

ROOT = Path(__file__).parents[3]
ARMS, LEARNERS, ARM = "192.168.1.5", "192.168.1.6", "127.0.0.80"
ENDLESS = """\
name: endless
experiment: {epochs: 1000, trials: 1, steps: 200, evaluate_every: 500, test_epochs: 1, checkpoint_every: 1,
  void_limit: 500}
"""
SLICE_S, STILL_RAD_S, MOVES_RAD_S = 0.002, 0.01, 0.15
REST_S = 0.8
CASES = {
    "cut": {"is_cut": True},
    "delay_200ms": {"delay_ms": 200.0},
    "loss_5_percent": {"loss": 0.05},
    "duplicated_and_reordered": {"duplicate": 0.1, "reorder": 0.1},
}
FAULT_S = 4.0


class Machines:
    """A lab on two machines."""

    def __init__(self, folder, cable):
        self.folder, self.cable = folder, cable
        make_lab(folder, ARM, cell=None, bus=f"tls/{ARMS}:7447", keys="./keys")
        (folder / "endless.yaml").write_text(ENDLESS)
        for words in (
            ("init",), ("issue", "twin", "--host", ARMS), ("issue", "viewer", "--source", "supervisor"),
            *(("issue", role) for role in ("recorder", "perception", "robot", "learning", "viewer")),
        ):  # fmt: skip
            assert autotelic(folder, "keys", *words)[0] == 0
        table = ("rig.yaml", "--scenario", "small.yaml")
        self.up = self.start(cable.a, "up", *table, "--without", "learning", "--out", "up")
        self.until(lambda: "robot: started as" in self.log(), 120)
        time.sleep(5.0)
        self.learner = self.start(
            cable.b, "learn", "--rig", *table, "--preset", "endless.yaml", "--out", "run"
        )  # fmt: skip

    def start(self, namespace, *words):
        environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-c", "from robot.cli import main; main()", *words]
        with (self.folder / f"{words[0]}.txt").open("w") as said:
            return subprocess.Popen(
                self.cable.command(namespace, *command), cwd=self.folder, env=environment, stdout=said,
                stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    def log(self):
        path = self.folder / "up/logs/supervisor.log"
        return path.read_text() if path.exists() else ""

    def said(self):
        return (self.folder / "learn.txt").read_text()[-3000:]

    def until(self, is_so, timeout_s=60.0):
        end_s = time.monotonic() + timeout_s
        while not is_so():
            assert time.monotonic() < end_s, self.log() + self.said()
            time.sleep(0.02)

    def truth(self):
        with inside(self.cable.a):
            try:
                return ask_fault(ARM, "truth")
            except ControllerProcessError:
                return None

    def told_truth(self):
        """Return what the twin tells; a machine that is busy may let one question go unanswered."""
        for _ in range(20):
            truth = self.truth()
            if truth is not None:
                return truth
        raise AssertionError(f"the twin does not answer: {self.log()}")

    def until_moving(self):
        n = [0]

        def moves():
            assert self.learner.poll() is None, self.said()
            truth = self.truth()
            n[0] = n[0] + 1 if truth and max(map(abs, truth["qd_rad_s"])) > MOVES_RAD_S else 0
            return n[0] >= 3

        self.until(moves, 120.0)

    def last_motion_s(self, seconds):
        """Return when joints moved last within a time from now on, by the twin's slices, and over how much of it."""
        first = self.told_truth()["n_slices"]
        moved, n_moving, n, end_s = first, 0, 0, time.monotonic() + seconds
        while time.monotonic() < end_s:
            truth = self.told_truth()
            is_moving = max(map(abs, truth["qd_rad_s"])) > STILL_RAD_S
            moved = truth["n_slices"] if is_moving else moved
            n, n_moving = n + 1, n_moving + is_moving
            time.sleep(0.005)
        return (moved - first) * SLICE_S, n_moving / n

    def close(self):
        for process in (self.learner, self.up):
            os.killpg(process.pid, signal.SIGINT)
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    why = why_not()
    if why is not None:
        pytest.skip(why)
    with EmulatedCable(ARMS, LEARNERS) as cable:
        made = Machines(tmp_path_factory.mktemp("link"), cable)
        yield made
        cable.set()
        made.close()


@pytest.mark.parametrize("what", CASES)
def test_over_a_bad_link_the_arm_rests_where_it_must_and_the_run_goes_on_after(lab, what):
    lab.until_moving()
    lab.cable.set(**CASES[what])
    rested_s, share = lab.last_motion_s(FAULT_S)
    lab.cable.set()
    if what in ("cut", "delay_200ms"):
        assert rested_s < REST_S
    lab.until_moving()
    assert lab.learner.poll() is None
    assert "given up" not in lab.log()
    note_fault(
        "link", what, f"last motion after {rested_s:.2f} s, moving {100 * share:.0f} % of {FAULT_S:g} s; goes on"
    )
