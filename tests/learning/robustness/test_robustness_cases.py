import msgspec
import pytest

from config.loader import load_resolved, resolve
from config.resolved import dump_resolved
from learning.errors import LearningError
from learning.robustness.cases import CASES, case_named, under_case

replace = msgspec.structs.replace


@pytest.fixture(scope="module")
def resolved():
    return resolve()


@pytest.mark.parametrize(("n_done", "n_spans"), [(1, 1), (999, 1), (1000, 1), (1001, 2), (2000, 2)])
def test_the_rules_in_force_last_stay_in_force(resolved, n_done, n_spans):
    gone_on = under_case(resolved, CASES[0], n_done=n_done, n_more=50, n_tests=20)
    assert len(gone_on.scenario.schedule) == len(gone_on.rule_sets) == n_spans
    assert gone_on.rules_at(n_done + 49) == resolved.rules_at(n_done - 1)


def test_the_first_case_changes_nothing_but_how_long_and_how_often(resolved):
    gone_on = under_case(resolved, CASES[0], n_done=1500, n_more=50, n_tests=20)
    experiment = gone_on.learning.experiment
    assert (experiment.epochs, experiment.test_epochs) == (1550, 20)
    as_before = replace(gone_on.learning, experiment=resolved.learning.experiment)
    assert replace(gone_on, learning=as_before) == resolved


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_case_is_a_config_that_a_run_may_have(resolved, case, tmp_path):
    gone_on = under_case(resolved, case, n_done=300, n_more=50, n_tests=20)
    file = tmp_path / "config.yaml"
    file.write_text(dump_resolved(gone_on))
    assert load_resolved(file) == gone_on
    assert case_named(case.name) is case


def test_every_case_changes_one_thing_and_by_as_much_as_it_says():
    changed = {
        case.name: {name: value for name, value in msgspec.to_builtins(case.perturbation).items() if name != "name"}
        for case in CASES
        if case.perturbation is not None
    }
    plain = {"lag_factor": 1.0, "braking_factor": 1.0, "payload_kg": 0.0, "kinematics_m": 0.0, "tells_belief": False,
             "mass_factor": 1.0, "friction_factor": 1.0, "percept_m": [0.0, 0.0, 0.0]}  # fmt: skip
    by = {name: {key: value for key, value in each.items() if value != plain[key]} for name, each in changed.items()}
    by = {name: {k: list(v) if isinstance(v, tuple) else v for k, v in each.items()} for name, each in by.items()}
    assert {name: {k: v for k, v in each.items() if v != plain[k]} for name, each in by.items()} == {
        "lag_plus_20": {"lag_factor": 1.2},
        "lag_minus_20": {"lag_factor": 0.8},
        "mass_plus_20": {"mass_factor": 1.2},
        "mass_minus_20": {"mass_factor": 0.8},
        "friction_plus_20": {"friction_factor": 1.2},
        "friction_minus_20": {"friction_factor": 0.8},
        "kinematics_plus_2mm": {"kinematics_m": 0.002, "tells_belief": True},
        "percept_1cm_away": {"percept_m": [0.01, 0.0, 0.0]},
        "percept_1cm_aside": {"percept_m": [0.0, 0.01, 0.0]},
    }
    assert [(case.name, case.carried_out) for case in CASES if case.perturbation is None] == [
        ("nominal", 1.0), ("experts_60", 0.6),
    ]  # fmt: skip


def test_experts_that_stray_already_stray_more(resolved):
    expert = replace(resolved.learning.expert, carried_out=0.5)
    worse = replace(resolved, learning=replace(resolved.learning, expert=expert))
    gone_on = under_case(worse, case_named("experts_60"), n_done=3, n_more=1, n_tests=1)
    assert gone_on.learning.expert.carried_out == pytest.approx(0.3)


def test_an_unknown_case_is_told_with_those_that_there_are():
    with pytest.raises(LearningError, match=r"expected a case of nominal, lag_plus_20, .*, got lag"):
        case_named("lag")
