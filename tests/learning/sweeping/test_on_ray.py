"""A sweep on Ray comes to the same bytes as one on this machine's processes, whatever becomes of its workers."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from learning.errors import LearningError
from learning.sweeping import on_ray
from learning.sweeping.cli import sweep
from learning.sweeping.manifest import read_manifest
from learning.sweeping.on_ray import RayExecutor

app = Typer()
app.command()(sweep)
TINY = "name: tiny\nscenarios: [paper]\nseeds: [1, 2]\nepochs: 12\njudged: false\n"
CELLS = ("paper-default-twin-1", "paper-default-twin-2")
TABLES = ("trials.csv", "goals.csv", "evaluations.csv")


def begun(tmp_path, out, on):
    (tmp_path / "sweep.yaml").write_text(TINY)
    words = ["sweep", str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / out), "--jobs", "2", "--on", on]
    return subprocess.Popen(
        [sys.executable, "-c", "from robot.cli import main; main()", *words],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=tmp_path,
    )  # fmt: skip


def told(folder):
    """What a sweep came to: the merged figures, and each cell's tables and newest checkpoint."""
    cells = [path for cell in CELLS for path in sorted((folder / cell).rglob("*"))]
    kept = [p for p in cells if p.name in TABLES or ("checkpoints" in p.parts and p.is_file())]
    assert len(kept) >= 2 * len(CELLS)
    return {str(p.relative_to(folder)): p.read_bytes() for p in (folder / "report" / "summary.json", *kept)}


def finished(child):
    said, _ = child.communicate(timeout=1200)
    assert child.returncode == 0, said


def processes_of(folder):
    """Return the processes that learn a cell of a sweep, each with who started it: its worker."""
    found = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                words = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError):
                continue
            if any(word.startswith(f"{folder}/paper-") for word in words):
                found[int(entry.name)] = parent
    return found


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_local_ray_comes_to_the_bytes_of_this_machines_processes_though_a_worker_is_lost(tmp_path):
    pytest.importorskip("ray")
    finished(begun(tmp_path, "here", "here"))
    child = begun(tmp_path, "there", "ray")
    began = tmp_path / "there" / CELLS[0] / "trials.csv"
    end_s = time.monotonic() + 300
    while not (began.exists() and len(began.read_text().splitlines()) > 3):
        assert time.monotonic() < end_s
        assert child.poll() is None, child.stdout.read()
        time.sleep(0.1)
    cells = processes_of(tmp_path / "there")
    worker = next(iter(cells.values()))
    os.kill(worker, signal.SIGKILL)
    finished(child)
    assert told(tmp_path / "there") == told(tmp_path / "here")
    failures = read_manifest(tmp_path / "there").failures
    assert any("worker was lost" in failure.why for failure in failures)
    assert not processes_of(tmp_path / "there")


@pytest.mark.parametrize("on", ["rays", "ray:", "there", ""])
def test_whom_nobody_knows_is_refused_before_anything_is_run(tmp_path, on):
    (tmp_path / "sweep.yaml").write_text(TINY)
    result = CliRunner().invoke(app, [str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "out"), "--on", on])
    assert result.exit_code == 2
    assert "expected here, ray or ray:ADDRESS" in result.stderr
    assert not (tmp_path / "out").exists()


def test_without_ray_it_is_told_what_to_install(monkeypatch, tmp_path):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(on_ray, "import_module", missing)
    with pytest.raises(LearningError, match="pip install"):
        RayExecutor(address=None, n_slots=1, logs=tmp_path)
