"""The wheel, installed in an empty folder, is all that a user needs."""

import csv
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from config.loader import load_resolved
from config.sources import shipped_names

ROOT = Path(__file__).parents[1]
ROOMS = ("config", "learning", "perception", "robot", "sim_twin")
OF_TESTS = re.compile(r"(?:^|[/_])tests?[/_.]")
QUICK = "experiment: {trials: 2, steps: 30, evaluate_every: 2, test_epochs: 1, checkpoint_every: 1}\n"
FOLDERS = ("arms", "cells", "learning", "limits", "rigs", "rules", "scenarios", "sweeps")
MEASURED = ("cameras", "colours")
"""Their files are made by a command, and checked where they are used."""


def run(*command, cwd, **environment):
    """Run a command and return what it did; it may last two minutes."""
    return subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build the wheel from a copy of the tree, so that the tree stays clean; return its path."""
    tree = tmp_path_factory.mktemp("tree")
    for room in (*ROOMS, "tests"):
        shutil.copytree(ROOT / room, tree / room, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, tree / file)
    built = run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tree / "dist", tree, cwd=tree)
    assert built.returncode == 0, built.stdout + built.stderr
    (path,) = (tree / "dist").glob("*.whl")
    return path


@pytest.fixture(scope="module")
def call(wheel, tmp_path_factory):
    """Install the wheel beside this environment's packages; return how to run its command in an empty folder."""
    site = tmp_path_factory.mktemp("site")
    pip = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-index")
    installed = run(sys.executable, *pip, "--target", site, wheel, cwd=site)
    assert installed.returncode == 0, installed.stderr
    empty = tmp_path_factory.mktemp("empty")

    def command(*arguments, program=site / "bin" / "autotelic", **environment):
        return run(program, *arguments, cwd=empty, PYTHONPATH=str(site), OMP_NUM_THREADS="1", **environment)

    command.site, command.folder = site, empty
    return command


def test_the_wheel_holds_the_rooms_their_data_and_the_licence_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == set(ROOMS)
    assert not [name for name in names if OF_TESTS.search(name.lower()) or name.endswith((".pyc", ".pyi", ".toml"))]
    assert {name for name in names if name.endswith(".yaml")} == {
        f"config/{folder}/{name}.yaml" for folder in FOLDERS + MEASURED for name in shipped_names(folder)
    }
    modules = {str(path.relative_to(ROOT)) for room in ROOMS for path in (ROOT / room).rglob("*.py")}
    assert {name for name in names if name.endswith(".py")} == modules
    assert {name for name in names if name.endswith("py.typed")} == {f"{room}/py.typed" for room in ROOMS}
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_the_installed_packages_are_the_wheels(call):
    script = f"import {', '.join(ROOMS)}; print(*({', '.join(f'{room}.__file__' for room in ROOMS)},), sep='\\n')"
    result = call("-c", script, program=sys.executable)
    assert result.returncode == 0, result.stderr
    assert all(Path(line).is_relative_to(call.site) for line in result.stdout.split())


def test_the_shipped_configs_are_found_and_right(call):
    result = call("config", "check")
    assert result.returncode == 0, result.stderr
    assert result.stdout.count("ok: ") == sum(len(shipped_names(folder)) for folder in FOLDERS)


@pytest.mark.parametrize("is_compiled", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_few_epochs_of_learning_leave_a_run_folder(call, is_compiled):
    """Compiled it takes 20 s longer: what was just installed has no machine code yet."""
    shipped = (call.site / "config" / "learning" / "default.yaml").read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in shipped if not line.startswith("experiment:")]
    assert len(kept) == len(shipped) - 1
    (call.folder / "quick.yaml").write_text("".join(kept) + QUICK, encoding="utf-8")
    names = ("--scenario", "paper", "--rig", "twin", "--preset", "quick.yaml")
    out = call.folder / f"out_{is_compiled}"
    jit = {} if is_compiled else {"NUMBA_DISABLE_JIT": "1"}
    result = call("learn", *names, "--seed", "3", "--epochs", "2", "--out", out.name, **jit)
    assert result.returncode == 0, result.stdout + result.stderr
    assert load_resolved(out / "config.yaml").scenario.name == "paper"
    with (out / "trials.csv").open(encoding="utf-8", newline="") as stream:
        assert {row["epoch"] for row in csv.DictReader(stream)} == {"0", "1"}
