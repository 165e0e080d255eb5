import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer import Typer
from typer.testing import CliRunner

from learning.sweeping.cli import sweep
from learning.sweeping.executor import Job
from learning.sweeping.local import LocalExecutor

app = Typer()
app.command()(sweep)
TINY = "name: tiny\nscenarios: [paper]\nseeds: [1, 2]\nepochs: 2\njudged: false\n"


def run(*words):
    return CliRunner().invoke(app, words)


def until(executor, seconds=60.0):
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        ends = executor.ended()
        if ends:
            return ends
        time.sleep(0.05)
    raise AssertionError("nothing ended")


@pytest.fixture
def executor(tmp_path):
    made = LocalExecutor(n_slots=1, logs=tmp_path / "logs")
    yield made
    made.close()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("config", "check", "--kind", "rig", "nowhere.yaml"), "exit code 2: error: nowhere.yaml"),
        (("config", "show"), None),
    ],
)
def test_a_process_that_ends_is_told_by_its_exit_and_its_last_word(executor, words, why):
    executor.start(Job(name="a", words=words, memory_mb=1000))
    (end,) = until(executor)
    assert end.why_failed is None if why is None else end.why_failed.startswith(why)


def test_a_process_that_takes_too_much_memory_is_ended_and_told(executor, tmp_path):
    executor.start(Job(name="a", words=("learn", "--out", str(tmp_path / "run"), "--epochs", "50"), memory_mb=20))
    (end,) = until(executor)
    assert "MB of memory where 20 are allowed" in end.why_failed


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (TINY + "rigs: [virtual_lab]\n", "rigs: expected rigs in lock-step"),
        (TINY + "presets: [defualt]\n", "did you mean default?"),
        ("name: x\n", "seeds: expected a list of at least 1 and at most 10000 entries"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_is(tmp_path, text, expected):
    (tmp_path / "sweep.yaml").write_text(text)
    result = run(str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert expected in result.stderr
    assert not (tmp_path / "out" / "sweep.json").exists()


def command(tmp_path, out):
    return [
        sys.executable, "-c", "from robot.cli import main; main()", "sweep", str(tmp_path / "sweep.yaml"), "--out",
        str(out), "--jobs", "2",
    ]  # fmt: skip


def finish(tmp_path, out):
    subprocess.run(command(tmp_path, out), check=True, capture_output=True, timeout=1200)
    return (out / "report" / "summary.json").read_bytes()


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_sweep_killed_at_random_instants_comes_to_the_same(tmp_path):
    (tmp_path / "sweep.yaml").write_text(TINY.replace("epochs: 2", "epochs: 12"))
    alone = finish(tmp_path, tmp_path / "alone")
    rng, out = np.random.default_rng(20), tmp_path / "killed"
    for _ in range(20):
        child = subprocess.Popen(command(tmp_path, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(float(rng.uniform(0.5, 12.0)))
        victims = [child.pid, *_children(child.pid)]
        os.kill(int(rng.choice(victims)), signal.SIGKILL)
        if child.poll() is None and rng.random() < 0.5:
            child.send_signal(signal.SIGINT)
            child.wait(120)
        child.kill()
        child.wait()
    assert finish(tmp_path, out) == alone


def _children(pid):
    return [
        int(entry)
        for entry in os.listdir("/proc")
        if entry.isdigit() and _parent(entry) == pid
    ]  # fmt: skip


def _parent(entry):
    try:
        with open(f"/proc/{entry}/stat") as stat:
            return int(stat.read().rsplit(")", 1)[1].split()[1])
    except (OSError, IndexError):
        return -1
