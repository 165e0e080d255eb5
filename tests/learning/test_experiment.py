"""Runs on a toy: deterministic, the same with any number of workers, the same when stopped or killed and resumed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from learning.errors import TooManyVoidEpochsError
from learning.interfaces import TrialOutcome
from learning.metrics import optimal_trials, summarise
from learning.rows import EvaluationRow, GoalRow, GraphRow, TrialRow, read_rows
from learning.seeds import reset_seed
from tests.support.toy_learner import CHANGE_EPOCH, N_GOALS, ToyStation, toy_allowed
from tests.support.toy_run import FILES, PROTOCOL, ToyRun, files_of

KILLED_AT = (40_000, 150_000, 171_313, 203_777, 255_001)
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An uninterrupted run."""
    folder = tmp_path_factory.mktemp("whole")
    run = ToyRun(folder, PROTOCOL, seed=5)
    assert run.go() == 120
    return folder


def optima():
    return [optimal_trials(lambda g, s, e=epoch: toy_allowed(g, s, e), N_GOALS) for epoch in (0, CHANGE_EPOCH)]


def test_the_toy_learns_recovers_and_needs_no_more_trials_than_the_optimum(whole):
    goals = read_rows(whole / "goals.csv", GoalRow)
    evaluations = read_rows(whole / "evaluations.csv", EvaluationRow)
    summary = summarise(
        goals, evaluations, [], n_goals=N_GOALS, n_trials=PROTOCOL.trials, changes=[CHANGE_EPOCH], optima=optima()
    )
    assert optima() == [(1, 1, 2, 4), (1, 1, 1, 2)]
    assert [era.learnt_after for era in summary.eras] == [pytest.approx(30, abs=20), pytest.approx(20, abs=20)]
    assert summary.eras[1].success_by_goal == (1.0,) * N_GOALS
    assert summary.eras[1].trials_over_optimum < 1.0


def test_rows_are_complete_and_in_order(whole):
    goals = read_rows(whole / "goals.csv", GoalRow)
    trials = read_rows(whole / "trials.csv", TrialRow)
    evaluations = read_rows(whole / "evaluations.csv", EvaluationRow)
    assert [row.epoch for row in goals] == list(range(120))
    for row in goals:
        of_epoch = [trial for trial in trials if trial.epoch == row.epoch]
        assert [trial.trial for trial in of_epoch] == list(range(1, row.n_trials + 1))
        assert sum(trial.n_steps for trial in of_epoch) == row.n_steps
        assert all(trial.goal == row.goal for trial in of_epoch)
        assert bool(row.is_achieved) == (of_epoch[-1].state_after[row.goal] == "1")
    graphs = read_rows(whole / "graphs.csv", GraphRow)
    assert [row.epoch for row in graphs] == [10, 20, 30, 40, 50, 60, 60, 70, 80, 90, 100, 110, 120]
    epochs = [10, 20, 40, 60, 60, 70, 80, 100, 120]
    assert [(row.epoch, row.goal) for row in evaluations] == [(e, g) for e in epochs for g in range(N_GOALS)]
    assert [row.rules_epoch for row in evaluations if row.epoch == 60] == [59] * N_GOALS + [60] * N_GOALS


def test_a_change_of_rules_is_seen_before_anything_is_relearnt(whole):
    evaluations = read_rows(whole / "evaluations.csv", EvaluationRow)
    at_change = [row for row in evaluations if row.epoch == CHANGE_EPOCH]
    old, new = at_change[:N_GOALS], at_change[N_GOALS:]
    assert old[2].success == 1.0
    assert new[2].graph_wrong > old[2].graph_wrong
    assert evaluations[-2].graph_wrong < new[2].graph_wrong


def test_same_seed_twice_is_identical_and_another_seed_is_not(whole, tmp_path):
    ToyRun(tmp_path, PROTOCOL, seed=5).go()
    assert files_of(tmp_path) == files_of(whole)
    (tmp_path / "other").mkdir()
    ToyRun(tmp_path / "other", PROTOCOL, seed=6).go()
    assert files_of(tmp_path / "other")["trials.csv"] != files_of(whole)["trials.csv"]


@pytest.mark.parametrize("n_workers", [1, 2])
def test_results_are_the_same_whatever_the_number_of_workers(whole, tmp_path, n_workers):
    ToyRun(tmp_path, PROTOCOL, seed=5, n_workers=n_workers).go()
    assert files_of(tmp_path) == files_of(whole)


@pytest.mark.parametrize("stop_at", [1, 37, 60, 119])
def test_stopped_at_any_epoch_and_resumed_is_identical(whole, tmp_path, stop_at):
    assert ToyRun(tmp_path, PROTOCOL, seed=5).go(stop_at=stop_at) == stop_at
    assert ToyRun(tmp_path, PROTOCOL, seed=5, resume=True).go() == 120
    assert files_of(tmp_path) == files_of(whole)


def test_a_stop_at_an_epoch_with_an_evaluation_finishes_that_evaluation(whole, tmp_path):
    assert ToyRun(tmp_path, PROTOCOL, seed=5).go(stop_at=20) == 20
    rows = read_rows(tmp_path / "evaluations.csv", EvaluationRow)
    assert [row.epoch for row in rows] == [10] * N_GOALS + [20] * N_GOALS
    assert rows == read_rows(whole / "evaluations.csv", EvaluationRow)[: 2 * N_GOALS]


def test_a_run_that_is_done_does_nothing_more_when_resumed(whole, tmp_path):
    ToyRun(tmp_path, PROTOCOL, seed=5).go()
    assert ToyRun(tmp_path, PROTOCOL, seed=5, resume=True).go() == 120
    assert files_of(tmp_path) == files_of(whole)


def test_a_dead_worker_is_reported_and_its_work_redone(whole, tmp_path):
    run = ToyRun(tmp_path, PROTOCOL, seed=5, n_workers=1)
    run.kill_workers_at = 40
    run.go()
    assert files_of(tmp_path) == files_of(whole)
    assert any("exit code -9" in line for line in run.said)


def test_killed_at_any_instant_and_resumed_is_identical(whole, tmp_path):
    """SIGKILL in the middle of whatever it does, from a fresh process each time."""
    command = [sys.executable, "-m", "tests.support.toy_run", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    codes = []
    for n_events in KILLED_AT:
        done = subprocess.run([*command, str(n_events)], cwd=ROOT, env=environment, check=False)
        codes.append(done.returncode)
    assert codes == [-signal.SIGKILL] * len(KILLED_AT)
    subprocess.run([*command, "0"], cwd=ROOT, env=environment, check=True)
    assert files_of(tmp_path) == files_of(whole)


def test_void_epochs_teach_nothing_and_too_many_running_fail_the_run(tmp_path):
    few = ToyRun(tmp_path, PROTOCOL, seed=5, void_epochs=(3, 4, 90))
    assert few.go() == 120
    rows = read_rows(tmp_path / "goals.csv", GoalRow)
    assert [row.epoch for row in rows if row.is_void] == [3, 4, 90]
    trials = read_rows(tmp_path / "trials.csv", TrialRow)
    assert {row.epoch for row in trials if row.outcome is TrialOutcome.VOID} == {3, 4, 90}
    (tmp_path / "many").mkdir()
    many = ToyRun(tmp_path / "many", PROTOCOL, seed=5, void_epochs=tuple(range(20, 120)))
    with pytest.raises(TooManyVoidEpochsError, match="10 epochs running"):
        many.go()


class LatchesWhenTested(ToyStation):
    """One station for learning and testing, cut short in every test epoch and in no other."""

    def reset(self, *, seed, epoch):
        self._void_epochs = () if seed == reset_seed(5, epoch) else (epoch,)
        return super().reset(seed=seed, epoch=epoch)


def test_a_latch_in_a_test_on_the_learners_own_station_counts_as_the_tests_alone(whole, tmp_path):
    protocol = msgspec.structs.replace(PROTOCOL, void_limit=2)
    assert ToyRun(tmp_path, protocol, seed=5, station=LatchesWhenTested()).go() == 120
    mine, theirs = files_of(tmp_path), files_of(whole)
    assert [name for name in FILES if mine[name] != theirs[name]] == ["evaluations.csv"]
    goals, rows = read_rows(tmp_path / "goals.csv", GoalRow), read_rows(tmp_path / "evaluations.csv", EvaluationRow)
    changes, best = (CHANGE_EPOCH,), optima()
    told = summarise(goals, rows, [], n_goals=N_GOALS, n_trials=PROTOCOL.trials, changes=changes, optima=best)
    assert told.n_void_epochs == 0
    assert [(row.n_tests, row.n_void, row.success) for row in rows] == [(0, 20, 0.0)] * len(rows)


def test_void_epochs_running_are_counted_across_a_stop(tmp_path):
    void = tuple(range(105, 120))
    assert ToyRun(tmp_path, PROTOCOL, seed=5, void_epochs=void).go(stop_at=110) == 110
    resumed = ToyRun(tmp_path, PROTOCOL, seed=5, void_epochs=void, resume=True)
    with pytest.raises(TooManyVoidEpochsError, match="the last one epoch 114"):
        resumed.go()


def test_the_files_of_a_run_are_its_tables_and_checkpoints(whole):
    assert set(files_of(whole)) == set(FILES)
    names = sorted(path.name for path in (whole / "checkpoints").iterdir())
    assert names == ["checkpoint-00000110.zip", "checkpoint-00000120.zip"]
