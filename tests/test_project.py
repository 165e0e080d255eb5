"""The project as a whole: packages, public names, sub-commands, pins."""

import ast
import importlib
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest
import typer

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
ROOMS = ("config", "learning", "perception", "robot", "sim_twin")
EDGES = {
    "abstract.added", "abstract.baselines", "abstract.bench", "abstract.learner", "abstract.oracle",
    "abstract.oracle_belief", "abstract.oracle_value", "abstract.outside", "abstract.outside_bench",
    "abstract.protocol", "abstract.rules", "abstract.table", "agent", "assembly", "assess", "bench", "checkpoint",
    "cli", "consent", "curves", "demonstrations", "ended", "environments.agents", "environments.cli",
    "environments.course", "environments.registration", "environments.rows", "environments.scene", "errors",
    "evaluation", "evaluation_pool", "experiment", "explain", "figure_style", "figures", "figures_compared", "film.cli",
    "film.filming", "film.lettering", "film.relive", "film.sheet", "film.story", "fingerprint", "goals", "metrics",
    "offline", "page", "page_style", "palette", "preceding", "progress", "provenance", "recorded", "recording",
    "replaying", "report", "report_files", "robot_hours", "robustness.cases", "robustness.cell", "robustness.cli",
    "robustness.figure", "robustness.fork", "robustness.result", "robustness.telling", "rows", "run_folder",
    "run_search", "seeds", "session", "session_bench", "statistics", "stops", "stopwatch", "straying", "sweeping.cells",
    "sweeping.choosing", "sweeping.cli", "sweeping.executor", "sweeping.local", "sweeping.manifest", "sweeping.on_ray",
    "sweeping.retrying", "sweeping.runner", "sweeping.table", "tables", "telling", "time_spent", "wanted", "wired",
}  # fmt: skip
"""Modules of learning that hold nothing learnt: what runs the learner, judges it, keeps it or tells of it."""
OWN_KEYS = {"config.learning", "config.values"}
"""All that what is learnt may read of the config."""
MOST_METHODS = 7
LISTED = PROJECT["tool"]["setuptools"]["packages"]


def packages_on_disk():
    inner = (init.parent.relative_to(ROOT) for room in ROOMS for init in (ROOT / room).rglob("__init__.py"))
    return sorted(".".join(package.parts) for package in inner)


def modules():
    return sorted(
        f"{package}.{module.name}"
        for package in LISTED
        for module in pkgutil.iter_modules([str(ROOT / package.replace(".", "/"))])
        if not module.ispkg
    )


def pins():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_the_packages_of_the_wheel_are_those_on_disk():
    assert sorted(LISTED) == packages_on_disk()


def test_every_folder_of_config_data_is_package_data():
    patterns = PROJECT["tool"]["setuptools"]["package-data"]["config"]
    folders = {path.parent.name for path in (ROOT / "config").glob("*/*.yaml")}
    assert {f"{folder}/*.yaml" for folder in folders} == {pattern for pattern in patterns if "/" in pattern}


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_says_that_it_is_typed(room):
    assert (ROOT / room / "py.typed").is_file()
    assert "py.typed" in PROJECT["tool"]["setuptools"]["package-data"][room]


@pytest.mark.parametrize("name", [*LISTED, *modules()])
def test_every_public_name_can_be_imported(name):
    module = importlib.import_module(name)
    public = getattr(module, "__all__", ())
    assert len(set(public)) == len(public)
    for attribute in public:
        assert getattr(module, attribute) is not None


@pytest.mark.parametrize("name", modules())
def test_every_module_says_what_it_is_for_and_what_is_public(name):
    module = importlib.import_module(name)
    assert module.__doc__
    assert hasattr(module, "__all__")


@pytest.mark.parametrize("group", ["autotelic.commands", "autotelic.benches"])
def test_the_installed_entry_points_are_those_of_the_project_file(group):
    assert {point.name: point.value for point in entry_points(group=group)} == PROJECT["project"]["entry-points"][group]


@pytest.mark.parametrize("name", sorted(PROJECT["project"]["entry-points"]["autotelic.commands"]))
def test_every_sub_command_resolves(name):
    (point,) = entry_points(group="autotelic.commands", name=name)
    registered = point.load()
    assert isinstance(registered, typer.Typer) or callable(registered)


@pytest.mark.parametrize("name", sorted(PROJECT["project"]["entry-points"]["autotelic.benches"]))
def test_every_bench_resolves(name):
    (point,) = entry_points(group="autotelic.benches", name=name)
    assert callable(point.load())


def test_every_pin_is_exact_and_once():
    names = [re.fullmatch(r"([A-Za-z0-9._-]+)==[0-9][0-9a-z.]*", pin) for pin in pins()]
    assert None not in names
    assert len({name[1].lower() for name in names}) == len(names)


def test_every_dependency_is_pinned():
    project = PROJECT["project"]
    wanted = [
        *project["dependencies"],
        *(name for extra in project["optional-dependencies"].values() for name in extra),
    ]
    pinned = {pin.split("==")[0].lower().replace("_", "-") for pin in pins()}
    assert {re.split(r"[\[<>=]", name)[0].lower().replace("_", "-") for name in wanted} <= pinned


def fence():
    contracts = PROJECT["tool"]["importlinter"]["contracts"]
    return next(c for c in contracts if c["name"] == "what is learnt cannot read what it should find out")


def test_every_module_of_learning_is_fenced_or_named_an_edge():
    on_disk = {name for name in modules() if name.startswith("learning.")}
    edges = {f"learning.{name}" for name in EDGES}
    fenced = set(fence()["source_modules"])
    assert not fenced & edges
    assert fenced | edges == on_disk


def test_what_is_learnt_may_read_nothing_of_the_config_but_its_own_keys():
    on_disk = {name for name in modules() if name.startswith("config.")}
    assert {name for name in fence()["forbidden_modules"] if name.startswith("config.")} == on_disk - OWN_KEYS
    assert not fence().keys() & {"ignore_imports", "allow_indirect_imports"}


@pytest.mark.parametrize(
    ("module", "line", "is_kept"),
    [
        ("novelty", "", True),
        ("novelty", "from config.sources import read_source", False),
        ("controls", "from config.yaml_text import parse_yaml", False),
        ("networks", "from learning.errors import LearningError", True),
        ("networks", "from learning.wanted import resolve_wanted", False),
        ("replay", "from robot.bus import TRUTH", False),
    ],
)
def test_the_fence_holds_what_it_says(tmp_path, module, line, is_kept):
    for room in ROOMS:
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__", "*.yaml"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    with (tmp_path / "learning" / f"{module}.py").open("a", encoding="utf-8") as file:
        file.write(f"\n{line}\n")
    result = subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (result.returncode == 0) is is_kept, result.stdout + result.stderr
    assert is_kept or f"{fence()['name']} BROKEN" in result.stdout


@pytest.mark.parametrize("room", ROOMS)
def test_no_door_has_more_than_seven_methods_of_its_own(room):
    for path in sorted((ROOT / room).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "Protocol" for base in node.bases):
                methods = [line for line in node.body if isinstance(line, ast.FunctionDef)]
                assert len(methods) <= MOST_METHODS, f"{path.relative_to(ROOT)}: {node.name} has {len(methods)}"
