"""What a run is made of goes into one file and comes back equal."""

import msgspec
import pytest

from config.errors import ConfigError
from config.loader import load_resolved, resolve
from config.resolved import dump_resolved


@pytest.mark.parametrize("scenario", ["paper", "workshop"])
@pytest.mark.parametrize("learning", ["default", "paper", "group"])
def test_a_resolved_config_reads_back_equal(tmp_path, scenario, learning):
    resolved = resolve(scenario=scenario, learning=learning)
    path = tmp_path / "config.yaml"
    path.write_text(dump_resolved(resolved), encoding="utf-8")
    assert load_resolved(path) == resolved


@pytest.mark.parametrize(
    "description", ["on", "1e3", "null", " a: b # c", "two\nlines", "\x85\u2028", "ünï ☃", "'", '"\\']
)
def test_a_description_of_any_text_survives(tmp_path, description):
    resolved = resolve()
    resolved = msgspec.structs.replace(
        resolved, scenario=msgspec.structs.replace(resolved.scenario, description=description)
    )
    path = tmp_path / "config.yaml"
    path.write_text(dump_resolved(resolved), encoding="utf-8")
    assert load_resolved(path) == resolved


@pytest.mark.parametrize(
    ("epoch", "name"),
    [(0, "paper_before"), (999, "paper_before"), (1000, "paper_after"), (5000, "paper_after")],
)
def test_rules_are_in_force_from_their_epoch_on(epoch, name):
    assert resolve(scenario="paper").rules_at(epoch).name == name


@pytest.mark.parametrize(
    ("old", "new", "where", "got"),
    [
        ("object: green_button", "object: gren_button", "goals[1].object", "did you mean green_button?"),
        ("from_epoch: 1000", "from_epoch: 0", "schedule[1].from_epoch", "0"),
        ("output: red_box", "output: green_box", "rules[0].output", "green_box"),
        ("model: ur5e", "model: ur3", "expected.model", "'ur3'"),
        ("tick_s: 0.01", "tick_s: 0.5", "rig.tick_s", "0.5"),
    ],
)
def test_a_resolved_config_is_checked_as_its_files_are(tmp_path, old, new, where, got):
    path = tmp_path / "config.yaml"
    text = dump_resolved(resolve(scenario="paper"))
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_resolved(path)
    assert caught.value.file.startswith(str(path))
    assert caught.value.where == where
    assert got in caught.value.got


def test_a_rule_set_too_few_is_refused(tmp_path):
    resolved = resolve(scenario="paper")
    path = tmp_path / "config.yaml"
    one = msgspec.structs.replace(resolved, rule_sets=resolved.rule_sets[:1])
    path.write_text(dump_resolved(one), encoding="utf-8")
    with pytest.raises(ConfigError, match="rule_sets: expected 2, one for each span of the schedule, got 1"):
        load_resolved(path)
