"""The shipped config files as trees that tests change and write where a loader finds them."""

from importlib import resources
from pathlib import Path

import msgspec
import yaml

from config.kinds import Kind
from config.loader import resolve

FOLDERS = {
    Kind.ARM: "arms",
    Kind.CELL: "cells",
    Kind.LEARNING: "learning",
    Kind.LIMITS: "limits",
    Kind.RIG: "rigs",
    Kind.RULES: "rules",
    Kind.SCENARIO: "scenarios",
}


def shipped_files():
    """Return kind and text of every shipped file, and of what resolves from them."""
    package = resources.files("config")
    found = [
        (kind, entry.read_text(encoding="utf-8"))
        for kind, folder in FOLDERS.items()
        for entry in sorted(package.joinpath(folder).iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".yaml")
    ]
    resolved = yaml.safe_dump(msgspec.to_builtins(resolve(scenario="workshop")), sort_keys=False)
    return [*found, (Kind.RESOLVED, resolved)]


def shipped_tree(folder, name):
    """Return the tree of a shipped file."""
    return yaml.safe_load(resources.files("config").joinpath(folder, f"{name}.yaml").read_text(encoding="utf-8"))


def write(folder: Path, name: str, tree: object) -> Path:
    """Write a tree as a YAML file and return its path."""
    path = folder / name
    path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
    return path
