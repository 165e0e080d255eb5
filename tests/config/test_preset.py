"""A preset that stands on another: what it says counts, the rest is the other's, and mistakes are told by file."""

import pytest

from config.errors import ConfigError
from config.loader import load_learning
from config.preset import MOST_BASES


@pytest.fixture
def write(tmp_path):
    def written(name, text):
        (tmp_path / f"{name}.yaml").write_text(f"name: {name}\n{text}\n")
        return tmp_path / f"{name}.yaml"

    return written


def test_keys_of_a_section_are_laid_over_those_below_and_the_rest_stays(write):
    default = load_learning("default")
    own = load_learning(write("own", "base: default\nsubgoal_selection: {hazard: 0.1}\nactions: {n_headings: 7}"))
    assert (own.name, own.subgoal_selection.hazard, own.actions.n_headings) == ("own", 0.1, 7)
    assert own.subgoal_selection.retest == default.subgoal_selection.retest
    assert own.goal_selection == default.goal_selection


def test_a_base_is_looked_for_from_where_the_file_lies_and_may_have_one_itself(write):
    write("below", "base: paper\nexpert: {trace: 33}")
    own = load_learning(write("own", "base: below.yaml\nexpert: {horizon: 44}"))
    assert (own.expert.trace, own.expert.horizon) == (33, 44)
    assert own.goal_selection == load_learning("paper").goal_selection


@pytest.mark.parametrize(
    ("base", "where", "expected"),
    [
        ("defualt", "base", "a path to a .yaml file or one of default"),
        ("nowhere.yaml", "base", "a file that can be read"),
        ("[default]", "base", "the name of a preset"),
        ("own.yaml", "base", f"at most {MOST_BASES} presets below one another"),
        ("broken.yaml", "expert.trace", "a whole number"),
    ],
)
def test_a_base_that_is_none_or_wrong_is_told_by_file_and_key(write, base, where, expected):
    write("broken", "expert: {trace: many}")
    with pytest.raises(ConfigError) as told:
        load_learning(write("own", f"base: {base}"))
    assert told.value.where == where
    assert expected in told.value.expected
    assert told.value.file.endswith("broken.yaml" if base == "broken.yaml" else "own.yaml")
