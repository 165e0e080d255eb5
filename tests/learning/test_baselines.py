"""Learners to compare with: what each of them keeps and drops."""

import numpy as np
import pytest

from config.learning import SubgoalSelection
from config.loader import load_learning
from config.sources import shipped_names
from learning.abstract import baselines
from learning.abstract.baselines import bench_baselines
from learning.abstract.learner import as_config_says
from learning.abstract.protocol import run_abstract
from learning.abstract.rules import draw_rules
from learning.goal_selector import GoalSelector
from learning.interfaces import Attempt, TrialOutcome
from learning.subgoal_selector import make_subgoal_selector

N = 3
ALL = (True,) * N
NONE = (False,) * N


def selector(kind, **config):
    config = {"alpha": 0.5, "gamma": 0.8, "competence_window": 5} | config
    return make_subgoal_selector(n_goals=N, config=SubgoalSelection(kind=kind, **config), rng=np.random.default_rng(0))


def trial(subgoal, *, is_achieved, before=NONE, goal=2):
    after = tuple(held or (is_achieved and i == subgoal) for i, held in enumerate(before))
    return Attempt(
        epoch=0, goal=goal, subgoal=subgoal, state=before, state_after=after,
        outcome=TrialOutcome.ACHIEVED if is_achieved else TrialOutcome.BLOCKED, predicted=0.5, skill=0.9, n_steps=10,
    )  # fmt: skip


def chosen(made, *, goal=2, state=NONE, available=ALL, explore=True, n=200):
    pick = [
        made.select(goal=goal, state=state, available=available, temperature=0.1, explore=explore) for _ in range(n)
    ]
    return np.bincount(pick, minlength=N) / n


@pytest.mark.parametrize("explore", [True, False])
@pytest.mark.parametrize("goal", range(N))
def test_direct_tries_the_goal_itself_whatever_it_needs(goal, explore):
    made = selector("direct")
    for _ in range(20):
        made.update(trial(goal, is_achieved=False, goal=goal))
    assert chosen(made, goal=goal, explore=explore, n=5)[goal] == 1.0


def test_mdp_goes_where_something_improves_and_where_the_way_to_that_begins():
    made = selector("mdp", temperature_least=0.05)
    for k in range(10):  # goal 1 begins to succeed, after goal 0
        made.update(trial(0, is_achieved=True))
        made.update(trial(1, is_achieved=k >= 5, before=(True, False, False)))
        made.update(trial(2, is_achieved=False))
    assert chosen(made, state=(True, False, False), available=(False, True, True))[1] > 0.8
    assert np.argmax(chosen(made)) == 0
    assert chosen(made, goal=1, state=(True, False, False), available=(False, True, True), explore=False)[1] == 1.0


def test_drop_begins_anew_where_a_goal_fails_that_used_to_succeed_and_not_before():
    made = selector("q_drop")
    for _ in range(8):
        made.update(trial(0, is_achieved=True))
    assert made.q_values(0, NONE)[0] > 0.9
    told = []
    while not told and made.q_values(0, NONE)[0] > 0.0:
        made.update(trial(0, is_achieved=False))
        told = list(made.changed_goals())
    assert told == [0, 1, 2]
    assert made.q_values(0, NONE).tolist() == [0.0] * N
    made.update(trial(0, is_achieved=False))
    assert not made.changed_goals()


def test_drop_takes_what_never_succeeded_for_no_change():
    made = selector("q_drop")
    for _ in range(50):
        made.update(trial(0, is_achieved=False))
        assert not made.changed_goals()


def test_random_draws_goals_evenly_whatever_improves():
    config = load_learning("random")
    made = GoalSelector(
        n_goals=4, config=config.goal_selection, subgoals=config.subgoal_selection, rng=np.random.default_rng(0)
    )
    for k in range(40):
        made.end_epoch(0, predicted=0.5, is_achieved=k > 20)
        made.update(trial(0, is_achieved=k > 20))
    assert made.probabilities() == pytest.approx([0.25] * 4)


@pytest.mark.parametrize("name", [name for name in shipped_names("learning") if name not in ("paper", "group")])
def test_every_preset_but_the_papers_two_readings_differs_from_default_in_one_thing(name):
    default, made = load_learning("default"), load_learning(name)
    below = load_learning("paper") if name == "fixed" else default
    parts = [part for part in default.__struct_fields__ if part not in ("name", "description")]
    changed = [part for part in parts if getattr(made, part) != getattr(below, part)]
    assert len(changed) <= (0 if name == "default" else 2 if name == "learned" else 1)
    assert made.name == name
    assert made.description not in ("", below.description) or name == "default"


def test_without_a_layer_of_sub_goals_a_goal_with_needs_is_not_mastered_and_with_it_it_is():
    rules = draw_rules(np.random.default_rng(5), 4, max_literals=2)
    made = {
        name: run_abstract(seed=5, learner=as_config_says(load_learning(name)), eras=[rules], epochs=60)
        for name in ("direct", "default")
    }
    assert made["default"].eras[0].mastered is not None
    assert made["direct"].eras[0].mastered is None


def test_the_bench_of_presets_tells_each_whose_upper_layers_differ(monkeypatch):
    class Here:
        def __init__(self, **_):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        map = staticmethod(map)

    for name, value in {"FEW": 1, "ERA_EPOCHS": 10, "N_SWITCHES": 1, "N_GOALS": 3, "ProcessPoolExecutor": Here}.items():
        monkeypatch.setattr(baselines, name, value)
    names = [row.name for row in bench_baselines(full=False).results]
    presets = {name.split("_learnt")[0] for name in names if name.endswith("_learnt_after")}
    assert presets == (set(shipped_names("learning")) - {"learned", "no_novelty"}) | {"oracle"}
    assert names[0] == "default_learnt_in_150"
