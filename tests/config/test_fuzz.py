"""A thousand files broken by machine: each gives a config error of one line, or a valid config, never a traceback."""

# ruff: noqa: E501

import copy

import numpy as np
import pytest
import yaml

from config.errors import ConfigError
from config.kinds import LOADERS, Kind, kind_of
from config.loader import resolve
from config.resolved import Resolved
from tests.support.config_files import shipped_files

N_FILES = 1000
LOADER, DUMPER = getattr(yaml, "CSafeLoader", yaml.SafeLoader), getattr(yaml, "CSafeDumper", yaml.SafeDumper)
"""In C, where there are such, and ten times as fast: they only make the files."""
WHOLE = {Kind.SCENARIO: "scenario", Kind.RIG: "rig", Kind.LEARNING: "learning"}
"""Kinds of file that a whole run can be resolved from beside shipped ones."""
EXTREMES = [
    None, True, False, 0, -1, 1, 16, 99, 2**31, 2**63, 10**30, 1e-300, 1e300, float("nan"), float("inf"), -float("inf"), -0.0,
    "", " ", "on", "nan", "table", "gripper", "../../x.yaml", "paper", "\n", "\x1b[2J", "é", "a" * 5000, [], {}, [[]], [None], {"x": 1},
    [1, 2], [0.0, 0.0, 0.0], {"output": 3}, [{"name": "x"}], "red_box", "!!int 3", "&a", "*a", "{", "%YAML",
]  # fmt: skip


def places(tree, way=()):
    """Return the path of every value below the root."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [found for key, value in entries for found in ((*way, key), *places(value, (*way, key)))]


def parent_of(tree, way):
    for key in way[:-1]:
        tree = tree[key]
    return tree


def delete(tree, way, rng):
    del parent_of(tree, way)[way[-1]]


def replace(tree, way, rng):
    parent_of(tree, way)[way[-1]] = copy.deepcopy(EXTREMES[rng.integers(len(EXTREMES))])


def scale(tree, way, rng):
    parent, key = parent_of(tree, way), way[-1]
    if isinstance(parent[key], int | float):
        parent[key] = parent[key] * float(rng.choice([-1.0, 0.5, 2.0, 10.0, 1e6])) + float(rng.choice([0.0, 1e-9, 0.1]))
    else:
        parent[key] = [parent[key]]


def rename(tree, way, rng):
    parent, key = parent_of(tree, way), way[-1]
    if isinstance(parent, dict):
        parent[key + str(rng.choice(["x", "_m", "", "\n", "é"]))] = parent.pop(key)


def double(tree, way, rng):
    parent, key = parent_of(tree, way), way[-1]
    if isinstance(parent, list):
        parent.insert(int(rng.integers(len(parent) + 1)), copy.deepcopy(parent[key]))
    else:
        parent[key] = [parent[key], copy.deepcopy(parent[key])]


def exchange(tree, way, rng):
    """Put one value in another's place: wrong references, wrong types, whole parts misplaced."""
    others = [other for other in places(tree) if other[: len(way)] != way]
    if others:
        other = others[rng.integers(len(others))]
        value = parent_of(tree, other)[other[-1]]
        parent_of(tree, way)[way[-1]] = copy.deepcopy(value)


TREE_MUTATIONS = [delete, replace, replace, scale, scale, rename, double, exchange, exchange]


def cut(content, rng):
    return content[: rng.integers(len(content))]


def noise(content, rng):
    spoilt = bytearray(content)
    for at in rng.integers(len(content), size=rng.integers(1, 6)):
        spoilt[at] = rng.integers(256)
    return bytes(spoilt)


def splice(content, rng):
    """Drop in a piece of YAML that means trouble."""
    troubles = [b"&a ", b"*a ", b"!!python/name:os.system ", b"---\n", b"...\n", b"\t", b"[" * 300, b"{" * 300, b"- " * 300, b"? ",
                b"<<: ", b"%TAG ! x\n", b"|\n", b">\n", b"'", b'"', b"\x00", b"\xef\xbb\xbf", b"\xff", b"#", b": ", b'"\\UFFFFFFFF"', b"\xe2\x80\xa8"]  # fmt: skip
    at = rng.integers(len(content))
    return content[:at] + troubles[rng.integers(len(troubles))] + content[at:]


def repeat_lines(content, rng):
    lines = content.splitlines(keepends=True)
    at = rng.integers(len(lines))
    return b"".join([*lines[: at + 1], *lines[at : at + rng.integers(1, 4)], *lines[at + 1 :]])


def garbage(content, rng):
    return rng.bytes(rng.integers(1, 400))


BYTE_MUTATIONS = [cut, noise, noise, splice, splice, splice, repeat_lines, garbage]


def spoil(text, rng):
    """Return a file's bytes after one to three mutations of its tree, of its bytes or of both."""
    content = text.encode()
    if rng.random() < 0.65:
        tree = yaml.load(text, Loader=LOADER)
        for _ in range(rng.integers(1, 4)):
            if ways := places(tree):
                TREE_MUTATIONS[rng.integers(len(TREE_MUTATIONS))](tree, ways[rng.integers(len(ways))], rng)
        content = yaml.dump(tree, Dumper=DUMPER, sort_keys=False, allow_unicode=True).encode("utf-8", "surrogatepass")
        if rng.random() < 0.85:
            return content
    return BYTE_MUTATIONS[rng.integers(len(BYTE_MUTATIONS))](content, rng)


def resolved_with(part, path):
    """Return what a file that loads makes together with the shipped ones, or why it does not go with them."""
    try:
        return resolve(**{part: path})
    except ConfigError as refusal:
        return refusal


@pytest.mark.parametrize("seed", range(4))
def test_hostile_files_give_a_config_error_or_a_valid_config(tmp_path, monkeypatch, seed):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(seed)
    files = shipped_files()
    path = tmp_path / "hostile.yaml"
    refusals, wholes = [], []
    for i in range(N_FILES // 4):
        kind, text = files[i % len(files)]
        path.write_bytes(spoil(text, rng))
        for load in (LOADERS[kind], kind_of) if i % 5 == 0 else (LOADERS[kind],):
            try:
                load(path)
            except ConfigError as refusal:
                refusals.append((load, refusal))
            else:
                wholes += [resolved_with(WHOLE[kind], path)] if kind in WHOLE else []
    assert [str(refusal) for _, refusal in refusals if not str(refusal).isprintable()] == []
    assert [str(refusal) for _, refusal in refusals if not refusal.expected or not refusal.got] == []
    share = sum(load is not kind_of for load, _ in refusals) / (N_FILES // 4)
    assert 0.5 < share < 0.98  # the mutations break most files, not all
    assert [str(whole) for whole in wholes if isinstance(whole, ConfigError) and not str(whole).isprintable()] == []
    assert any(isinstance(whole, Resolved) for whole in wholes)
