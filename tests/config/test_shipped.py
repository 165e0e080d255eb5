"""What the shipped scenarios and presets promise."""

import itertools

import pytest

from config.footprints import clearance_m, footprint_of_box, footprint_of_button
from config.loader import load_learning, load_rules, load_scenario, load_wired, resolve
from config.sources import shipped_names


@pytest.mark.parametrize("name", shipped_names("scenarios"))
def test_every_shipped_scenario_goes_with_the_twins_arm(name):
    assert resolve(scenario=name).scenario.name == name


@pytest.mark.parametrize("name", shipped_names("scenarios"))
def test_everything_on_the_table_is_drawn_from_three_centimetres_to_either_side_at_least(name):
    scenario = load_scenario(name)
    standing = (*scenario.buttons, *scenario.boxes, *(c for c in scenario.cylinders if c.inside is None))
    assert min(min(thing.spread_m) for thing in standing) >= 0.03
    assert min(scenario.start.spread_m[:2]) >= 0.03


def test_workshop_keeps_three_centimetres_around_what_swings():
    scenario = load_scenario("workshop")
    boxes = [footprint_of_box(box, with_leaves=True) for box in scenario.boxes]
    buttons = [footprint_of_button(button) for button in scenario.buttons]
    pairs = [*itertools.combinations(boxes, 2), *itertools.product(boxes, buttons)]
    assert min(clearance_m(a, b) for a, b in pairs) >= 0.03


def test_workshop_has_what_the_paper_scenario_has_not():
    workshop, rule_sets = load_wired("workshop")
    paper = load_scenario("paper")
    assert len(workshop.goals) > len(paper.goals)
    assert any(cylinder.is_distractor for cylinder in workshop.cylinders)
    assert any(cylinder.inside is None for cylinder in workshop.cylinders)
    assert len(workshop.schedule) == 2
    for rule_set in rule_sets:
        conditions = [rule.when for rule in rule_set.rules]
        assert any(len(when) > 1 for when in conditions)  # AND
        assert any(not literal.is_on for when in conditions for literal in when)  # NOT


def test_the_papers_rule_sets_say_what_the_paper_says():
    wanted = {
        "paper_before": {"red_box": {("green_button", True)}, "blue_box": {("blue_button", True)}, "square_box": set()},
        "paper_after": {
            "red_box": {("green_button", False)},
            "blue_box": {("blue_button", False)},
            "square_box": {("orange_button", True)},
        },
    }
    for name, conditions in wanted.items():
        rules = load_rules(name).rules
        assert {rule.output: {(literal.input, literal.is_on) for literal in rule.when} for rule in rules} == conditions


def test_the_papers_preset_is_the_text_and_the_groups_is_the_code():
    paper, group = load_learning("paper"), load_learning("group")
    assert (paper.goal_selection.improvement, paper.goal_selection.window) == ("printed", 10)
    assert paper.subgoal_selection.temperature == "one_minus_improvement"
    assert not paper.subgoal_selection.known_context
    assert group.goal_selection.improvement == "clipped_success"
    assert group.subgoal_selection.temperature == "one_minus_competence"
    assert group.subgoal_selection.known_context
    for preset in (paper, group):
        assert (preset.experiment.epochs, preset.experiment.trials, preset.experiment.steps) == (2000, 8, 70)
        assert (preset.subgoal_selection.kind, preset.forward_model.kind) == ("q", "geometric")
