"""Runs on contact physics with all the real parts: deterministic, and the same when killed and resumed."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from config.loader import resolve
from learning.rows import GoalRow, TrialRow, read_rows
from tests.support.toy_run import FILES, files_of

ROOT = Path(__file__).parents[2]
QUICK = "experiment: {trials: 2, steps: 30, evaluate_every: 4, test_epochs: 1, checkpoint_every: 2}\n"
N_EPOCHS = 6


def command(preset, out, *arguments):
    program = [sys.executable, "-c", "from robot.cli import main; main()", "learn", "--rig", "twin", "--resume"]
    return [*program, "--preset", str(preset), "--out", str(out), *map(str, arguments)]


def learn(preset, out, *arguments):
    done = subprocess.run(command(preset, out, *arguments), cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return files_of(out)


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("paper", "group")]


@pytest.fixture(scope="module", params=["default", *SLOW])
def preset(request, tmp_path_factory):
    """A shipped learner with a shorter protocol, as a file."""
    path = tmp_path_factory.mktemp("presets") / f"{request.param}.yaml"
    shipped = (ROOT / "config" / "learning" / f"{request.param}.yaml").read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in shipped if not line.startswith("experiment:")) + QUICK)
    return path


@pytest.fixture(scope="module")
def whole(preset, tmp_path_factory):
    """An uninterrupted run without workers."""
    out = tmp_path_factory.mktemp("runs") / "whole"
    return out, learn(preset, out, "--epochs", N_EPOCHS, "--workers", 0)


def test_a_run_on_the_twin_is_whole_and_physics_did_something(whole):
    out, files = whole
    assert set(files) == set(FILES)
    assert len(read_rows(out / "goals.csv", GoalRow)) == N_EPOCHS
    trials = read_rows(out / "trials.csv", TrialRow)
    assert {len(row.state) for row in trials} == {len(resolve().scenario.goals)}
    assert any("1" in row.state_after for row in trials)


@pytest.mark.parametrize("kills", [(3,), pytest.param((2, 3, 4), marks=pytest.mark.slow)], ids=["once", "thrice"])
def test_killed_and_resumed_with_a_worker_is_identical(preset, whole, tmp_path, kills):
    out = tmp_path / "killed"
    arguments = ("--epochs", N_EPOCHS, "--workers", 1)
    for n_epochs in kills:
        with subprocess.Popen(command(preset, out, *arguments), cwd=ROOT, stderr=subprocess.DEVNULL) as process:
            while _n_epochs(out) < n_epochs and process.poll() is None:
                time.sleep(0.02)
            process.kill()
        assert process.returncode == -signal.SIGKILL, "the run was over, or stopped by somebody else, before the kill"
    assert learn(preset, out, *arguments) == whole[1]


def _n_epochs(out):
    goals = out / "goals.csv"
    return len(goals.read_bytes().splitlines()) - 1 if goals.exists() else 0
