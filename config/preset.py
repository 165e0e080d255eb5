"""A learner's preset that says only what it changes of another: `base: default`, and the keys that differ."""

from config.errors import ConfigError
from config.sources import Source, read_source
from config.yaml_text import Tree, parse_yaml

__all__ = ["MOST_BASES", "grown"]

BASE = "base"
MOST_BASES = 4
"""Presets that may stand on one another."""


def grown(source: Source) -> tuple[Tree, list[tuple[Tree, str]]]:
    """Return what a preset says with what its bases say below it, and each of them alone with its file.

    Sections are laid over one another key by key; anything else is replaced.

    Raises:
        ConfigError: a base that is none, or too many of them.
    """
    own, told, alone = parse_yaml(source.text, source.file), [], source
    trees: list[Tree] = []
    while True:
        told.append((_without_base(own), alone.file))
        trees.append(_without_base(own))
        if not isinstance(own, dict) or BASE not in own:
            break
        if len(trees) > MOST_BASES:
            raise ConfigError(alone.file, BASE, f"at most {MOST_BASES} presets below one another", "more")
        name = own[BASE]
        if not isinstance(name, str):
            raise ConfigError(alone.file, BASE, "the name of a preset, or a path to one", repr(name))
        try:
            alone = read_source("learning", name, base=alone.folder)
        except ConfigError as error:
            raise ConfigError(alone.file, BASE, error.expected, error.got) from error
        own = parse_yaml(alone.text, alone.file)
    whole = trees[-1]
    for tree in reversed(trees[:-1]):
        whole = _laid_over(whole, tree)
    return whole, told


def _without_base(tree: Tree) -> Tree:
    return {key: value for key, value in tree.items() if key != BASE} if isinstance(tree, dict) else tree


def _laid_over(below: Tree, above: Tree) -> Tree:
    """Return what both say, the upper one where both say something."""
    if not isinstance(below, dict) or not isinstance(above, dict):
        return above
    shared = {key: _laid_over(below[key], value) if key in below else value for key, value in above.items()}
    return {**below, **shared}
