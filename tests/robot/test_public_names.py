import pkgutil
from importlib import import_module

import pytest

import perception
import robot

MODULES = [
    name
    for package in (robot, perception)
    for _, name, _ in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
]


@pytest.mark.parametrize("name", MODULES)
def test_every_public_name_exists_and_is_documented(name):
    module = import_module(name)
    assert module.__doc__
    for public in getattr(module, "__all__", ()):
        assert getattr(module, public).__doc__ or not callable(getattr(module, public)), public


@pytest.mark.parametrize("name", ["robot.hal", "robot.motion", "robot.safety", "perception"])
def test_a_sub_package_exports_its_public_names(name):
    assert import_module(name).__all__
