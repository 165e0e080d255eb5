"""The project as a whole: packages, public names, sub-commands, pins."""

import importlib
import pkgutil
import re
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest
import typer

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
ROOMS = ("config", "learning", "perception", "robot", "sim_twin")
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
    assert {f"{folder}/*.yaml" for folder in folders} == set(patterns)


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
