"""A run on the twin whose scenario says that goals become known later."""

import json

import msgspec
import pytest
from typer.testing import CliRunner

from config.loader import resolve
from config.yaml_text import dump_yaml
from learning.assembly import build_agent
from learning.checkpoint import encode
from learning.report import load_run
from learning.run_folder import RunFolder
from learning.telling import summary_lines
from learning.wanted import Wanted
from robot.cli import app
from robot.oracle import rules_oracle
from tests.support.kinematic_table import KinematicTable
from tests.support.quiet_run import learn_quietly
from tests.support.toy_run import files_of

replace = msgspec.structs.replace
N_EPOCHS, ARRIVAL = 8, 4
QUICK = (
    "base: default\nname: quick\nexperiment: {epochs: 8, trials: 2, steps: 8, evaluate_every: 4, test_epochs: 1, "
    "dense_every: 2, dense_for: 2, checkpoint_every: 2}\n"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("later")
    shipped = resolve().scenario
    goals = (*shipped.goals[:4], *(replace(goal, from_epoch=ARRIVAL) for goal in shipped.goals[4:]))
    (path / "later.yaml").write_text(dump_yaml(msgspec.to_builtins(replace(shipped, goals=goals))))
    (path / "quick.yaml").write_text(QUICK)
    return path


def learn(folder, out, *, until=N_EPOCHS):
    wanted = Wanted(scenario=str(folder / "later.yaml"), preset=str(folder / "quick.yaml"), seed=2)
    return learn_quietly(out, wanted, until=until)


@pytest.fixture(scope="module")
def whole(folder):
    return learn(folder, folder / "whole")


def test_goals_are_neither_wanted_nor_tried_nor_judged_before_they_are_known(whole):
    run, watcher = whole
    assert watcher.met == [(ARRIVAL, (4, 5))]
    trials = run.trials()
    assert {len(row.state) for row in trials if row.epoch < ARRIVAL} == {4}
    assert {len(row.state) for row in trials if row.epoch >= ARRIVAL} == {6}
    assert {g for row in trials if row.epoch < ARRIVAL for g in (row.goal, row.subgoal)} <= {0, 1, 2, 3}
    assert {row.goal for row in run.goals() if row.epoch >= ARRIVAL} & {4, 5}
    tested = {epoch: {row.goal for row in run.evaluations() if row.epoch == epoch} for epoch in (4, 6, 8)}
    assert tested == {4: {0, 1, 2, 3}, 6: set(range(6)), 8: set(range(6))}


@pytest.fixture(scope="module")
def early(folder):
    """A run that was stopped before the goals became known."""
    return learn(folder, folder / "early", until=2)[0]


@pytest.mark.parametrize("at", [pytest.param(3, marks=pytest.mark.slow), 4, pytest.param(5, marks=pytest.mark.slow)])
def test_stopped_and_taken_up_across_the_moment_is_identical(folder, whole, tmp_path, at):
    out = tmp_path / "run"
    learn(folder, out, until=at)
    assert RunFolder(out).checkpoints.newest()[0]["n_done"] == at
    learn(folder, out)
    assert files_of(out) == files_of(whole[0].path)


def test_a_checkpoint_says_how_many_goals_are_known_only_while_not_all_are(early, whole):
    assert early.checkpoints.newest()[0]["agent"]["n_goals"] == 4
    assert "n_goals" not in whole[0].checkpoints.newest()[0]["agent"]


def test_explain_and_evaluate_tell_which_goals_are_not_known_yet(early, whole):
    run = early
    told = CliRunner().invoke(app, ["explain", str(run.path)])
    assert told.exit_code == 0, told.output
    assert "blue_grabbed: not known yet, from epoch 4" in told.stdout
    as_json = json.loads(CliRunner().invoke(app, ["explain", str(run.path), "--json"]).stdout)
    assert as_json["not_known_yet"] == [4, 5]
    assert [entry["goal"] for entry in as_json["explanations"]] == [0, 1, 2, 3]
    tested = CliRunner().invoke(app, ["evaluate", str(run.path), "--tests", "1", "--json"])
    assert [row["goal"] for row in json.loads(tested.stdout)["rows"]] == [0, 1, 2, 3]
    later = json.loads(CliRunner().invoke(app, ["explain", str(whole[0].path), "--json"]).stdout)
    assert later["not_known_yet"] == []
    assert len(later["explanations"]) == 6


def test_the_report_tells_what_became_of_them(whole):
    run = load_run(whole[0])
    assert [(entry.goal, entry.from_epoch) for entry in run.summary.added] == [(4, 4), (5, 4)]
    assert [goal.from_epoch for goal in run.manifest.goals] == [0, 0, 0, 0, 4, 4]
    told = " ".join(summary_lines(run))
    assert "blue_grabbed, known from epoch 4: " in told


def test_where_all_are_known_from_the_first_epoch_nothing_is_as_it_was_not_before():
    resolved = resolve()
    agent = build_agent(resolved, KinematicTable(resolved.scenario).spec, seed=1)
    before = encode(agent.state_dict())
    assert agent.meet_goals(0) == agent.meet_goals(500) == ()
    assert encode(agent.state_dict()) == before
    assert "n_goals" not in agent.state_dict()


def test_what_is_not_known_yet_counts_as_off_for_who_judges_the_graph():
    allowed = rules_oracle(resolve())
    known = (False, False, True, False)  # blue pressed
    assert allowed(4, known, 0)
    assert not allowed(4, (True, True), 0)
    assert allowed(3, (False, True, False), 0)
    assert not allowed(3, (True, False), 0)
