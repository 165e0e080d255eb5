import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from typer.testing import CliRunner

from config.loader import resolve
from config.resolved import dump_resolved
from learning.checkpoint import encode
from learning.errors import LearningError
from learning.progress import Progress
from learning.robustness.cases import CASES, case_named
from learning.robustness.cell import n_steps_done, read_result, run_case
from learning.robustness.cli import _plan_of
from learning.rows import EvaluationRow
from learning.run_folder import RunFolder
from learning.wanted import Wanted
from robot.cli import app
from tests.support.quiet_run import learn_quietly
from tests.support.toy_folder import toy_manifest

QUICK = "base: default\nname: quick\nexperiment: {epochs: 4, trials: 2, steps: 12, evaluate_every: 4, test_epochs: 1}\n"


def autotelic(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def learn(folder, out, *, epochs=4):
    learn_quietly(out, Wanted(preset=str(folder / "quick.yaml"), seed=3, epochs=epochs))
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("robustness")
    (path / "quick.yaml").write_text(QUICK)
    return path


@pytest.fixture(scope="module")
def run(folder):
    """A run of four epochs on the twin."""
    return learn(folder, folder / "run")


@pytest.fixture(scope="module")
def tried(folder, run):
    """What that run bears, of two cases, two epochs more."""
    before = {path: path.read_bytes() for path in sorted(run.rglob("*")) if path.is_file()}
    for name in ("nominal", "mass_plus_20"):
        done = autotelic("robustness", run, "--tests", 1, "--epochs", 2, "--only", name, "--out", folder / "tried")
        assert done.exit_code == 0, done.output
    assert before == {path: path.read_bytes() for path in sorted(run.rglob("*")) if path.is_file()}
    return folder / "tried"


def learnt(run):
    return encode({"agent": run.checkpoints.newest()[0]["agent"]})


def test_tried_as_learnt_it_is_the_run_that_went_on(folder, tried):
    whole = RunFolder(learn(folder, folder / "longer", epochs=6))
    gone_on = RunFolder(tried / "nominal")
    assert gone_on.trials() == [row for row in whole.trials() if row.epoch >= 4]
    assert [row.epoch for row in gone_on.goals()] == [4, 5]
    assert learnt(gone_on) == learnt(whole)
    assert gone_on.evaluations() == [row for row in whole.evaluations() if row.epoch == 6]


def test_what_is_tested_first_is_what_evaluate_tells(run, tried):
    done = autotelic("evaluate", run, "--tests", 1, "--json")
    rows = [EvaluationRow(**row) for row in json.loads(done.stdout)["rows"]]
    assert list(read_result(tried / "nominal").before) == rows


def test_another_world_is_another_course_under_the_same_draws(tried):
    nominal, heavy = RunFolder(tried / "nominal"), RunFolder(tried / "mass_plus_20")
    assert heavy.manifest().model_sha256 != nominal.manifest().model_sha256
    assert heavy.goals()[0].goal == nominal.goals()[0].goal
    assert learnt(heavy) != learnt(nominal)


def test_a_case_that_was_stopped_between_goals_and_epochs_goes_on_to_the_same(run, tried, tmp_path):
    plan = _plan_of(RunFolder(run), n_tests=1, n_more=2, seed=None)
    case, own = case_named("mass_plus_20"), tmp_path / "own"

    def go(should_stop):
        return run_case(
            RunFolder(run), plan, case, own, now_s=time.perf_counter, should_stop=should_stop,
            progress_of=lambda _folder, n_done: Progress(
                goals=["g"] * 6, n_epochs=6, n_done=n_done, now_s=time.perf_counter
            ),
        )  # fmt: skip

    asked = iter([False, True])
    assert go(lambda: next(asked)) is None  # after the second goal
    first = n_steps_done(own)
    assert go(lambda: RunFolder(own).goals() != []) is None  # after the first epoch of going on
    assert first < n_steps_done(own)
    assert read_result(own) is None
    assert go(lambda: False) == read_result(own)
    assert (own / "result.json").read_bytes() == (tried / "mass_plus_20" / "result.json").read_bytes()
    for name in ("trials.csv", "evaluations.csv", "graphs.csv"):
        assert (own / name).read_bytes() == (tried / "mass_plus_20" / name).read_bytes()


def test_a_folder_of_another_plan_or_of_something_else_is_refused(run, tried, tmp_path):
    done = autotelic("robustness", run, "--tests", 2, "--epochs", 2, "--only", "nominal", "--out", tried)
    assert done.exit_code == 2
    assert "was begun with another n_tests (n_tests 1)" in done.stderr
    (tmp_path / "holiday.png").touch()
    done = autotelic("robustness", run, "--only", "nominal", "--out", tmp_path)
    assert done.exit_code == 2
    assert "found holiday.png in it" in done.stderr


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("absent",), 2, "expected a run folder"),
        (("{run}", "--only", "lag"), 1, "expected a case of nominal, lag_plus_20"),
        (("{run}", "--on", "mars"), 2, "expected here, ray or ray:ADDRESS, got mars"),
        (("{run}", "--tests", "0"), 2, "--tests"),
    ],
)
def test_bad_usage_is_told_in_words(run, tmp_path, words, code, told):
    done = autotelic("robustness", *(word.format(run=run) for word in words), "--out", tmp_path / "out")
    assert done.exit_code == code
    assert told in done.output
    assert "Traceback" not in done.output
    assert not (tmp_path / "out").exists()


def test_a_run_on_a_plant_that_is_no_twin_is_refused(tmp_path):
    with RunFolder(tmp_path / "fake") as out:
        out.start(toy_manifest(), dump_resolved(resolve(rig="fake")))
    done = autotelic("robustness", out.path)
    assert done.exit_code == 1
    assert "expected a run on a twin in lock-step" in done.stderr


def test_a_run_that_has_learnt_nothing_is_refused(run, tmp_path):
    out = RunFolder(tmp_path / "new")
    with out:
        out.start(RunFolder(run).manifest(), (run / "config.yaml").read_text())
    done = autotelic("robustness", out.path)
    assert done.exit_code == 1
    assert "no readable checkpoint" in done.stderr
    out.checkpoints.save(0, encode({"n_done": 0}))
    done = autotelic("robustness", out.path)
    assert done.exit_code == 1
    assert "it has done no epoch: go on with it first" in done.stderr


def test_a_result_that_was_torn_is_told(tried, tmp_path):
    (tmp_path / "result.json").write_bytes((tried / "nominal" / "result.json").read_bytes()[:50])
    with pytest.raises(LearningError, match="delete it to have it anew"):
        read_result(tmp_path)


def command(run, out):
    return [
        sys.executable, "-c", "from robot.cli import main; main()", "robustness", str(run), "--tests", "1", "--epochs",
        "2", "--out", str(out), "--jobs", "2",
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_all_cases_killed_at_random_instants_come_to_the_same(run, tmp_path):
    alone = subprocess.run(command(run, tmp_path / "alone"), check=True, capture_output=True, text=True, timeout=600)
    assert all(case.name in alone.stderr for case in CASES)
    rng = np.random.default_rng(4)
    for _ in range(8):
        child = subprocess.Popen(
            command(run, tmp_path / "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(float(rng.uniform(2.0, 15.0)))
        child.send_signal(signal.SIGINT if rng.random() < 0.3 else signal.SIGKILL)
        child.wait(120)
    subprocess.run(command(run, tmp_path / "killed"), check=True, capture_output=True, timeout=600)
    names = ("robustness.json", "robustness.svg", *(os.path.join(case.name, "result.json") for case in CASES))
    for name in names:
        assert (tmp_path / "alone" / name).read_bytes() == (tmp_path / "killed" / name).read_bytes()
