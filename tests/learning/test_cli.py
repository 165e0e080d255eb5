"""The learning commands as a person meets them: run folders, errors in one line, exit codes."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from learning.checkpoint import decode, encode
from learning.metrics import Summary
from learning.report import Report
from learning.rows import EvaluationRow
from learning.run_folder import RunFolder
from robot.cli import app
from tests.support.toy_folder import make_toy_folder

TABLES = ("evaluations.csv", "goals.csv", "graphs.csv", "trials.csv")
FILES = ("config.yaml", "profile.json", "run.json", "stops.json", "summary.json", *TABLES)


def autotelic(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def learn(out, *arguments):
    return autotelic("learn", "--rig", "fake", "--preset", "fast.yaml", "--workers", "0", "--out", out, *arguments)


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    """A working folder with a quick learner in it."""
    path = tmp_path_factory.mktemp("work")
    (path / "fast.yaml").write_text(
        "name: fast\n"
        "experiment: {epochs: 4, trials: 2, steps: 5, evaluate_every: 2, test_epochs: 1, checkpoint_every: 1}\n"
    )
    before = Path.cwd()
    os.chdir(path)
    yield path
    os.chdir(before)


@pytest.fixture(scope="module")
def run(folder):
    """A finished run."""
    done = learn("done", "--json")
    assert done.exit_code == 0, done.output
    return folder / "done", done


def lines(done):
    return (done.stderr or done.output).strip().splitlines()


def test_learn_leaves_a_whole_run_folder_and_prints_its_summary(run):
    path, done = run
    assert sorted(entry.name for entry in path.iterdir() if entry.is_file() and entry.name != "lock") == sorted(FILES)
    assert sorted(entry.name for entry in (path / "figures").iterdir()) == [
        "curriculum.pdf", "curriculum.png", "curriculum.svg", "figure2.pdf", "figure2.png", "figure2.svg",
        "report.html", "summary.json",
    ]  # fmt: skip
    summary = json.loads(done.stdout)
    assert summary == json.loads((path / "summary.json").read_text())
    assert summary["n_epochs"] == 4
    assert set(summary) == set(Summary.__struct_fields__)


def test_the_profile_tells_where_the_time_went(run):
    profile = json.loads((run[0] / "profile.json").read_text())
    assert {"physics", "stack", "experts", "selectors", "training", "evaluation"} <= set(profile["seconds_by_layer"])
    assert sum(profile["seconds_by_layer"].values()) == pytest.approx(profile["seconds"], rel=0.05)


def test_a_second_start_is_refused_and_resuming_a_finished_run_is_done_at_once(run):
    again = learn("done")
    assert again.exit_code == 2
    assert lines(again) == [
        "error: done holds a run already: go on with it by --resume, or name another folder by --out"
    ]
    before = [(run[0] / name).read_bytes() for name in ("trials.csv", "profile.json")]
    resumed = learn("done", "--resume")
    assert resumed.exit_code == 0, resumed.output
    assert [(run[0] / name).read_bytes() for name in ("trials.csv", "profile.json")] == before


def test_resume_begins_a_run_where_there_is_none(folder):
    assert learn("fresh", "--resume", "--epochs", 1).exit_code == 0
    assert RunFolder(folder / "fresh").manifest().n_epochs == 1


def test_a_run_folder_may_have_any_name(folder):
    out = folder / "[v2]" / "m[" / "x]"
    done = learn(out, "--epochs", 1)
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[0].startswith(f"{out}: 1 epochs")
    assert done.stdout.splitlines()[-1] == f"figures in {out}/figures"


def test_resuming_with_a_changed_config_is_refused_and_changes_nothing(run, tmp_path):
    out = tmp_path / "run"
    shutil.copytree(run[0], out)
    config = (out / "config.yaml").read_text()
    (out / "config.yaml").write_text(config.replace("hazard: 0.01", "hazard: 0.2").replace("epochs: 4", "epochs: 5"))
    assert (out / "config.yaml").read_text() != config
    done = learn(out, "--resume")
    assert done.exit_code == 2
    assert "config.yaml: expected the config that the run began with" in lines(done)[-1]
    assert (out / "trials.csv").read_bytes() == (run[0] / "trials.csv").read_bytes()
    (out / "config.yaml").write_text(config)
    assert learn(out, "--resume").exit_code == 0


def test_resuming_with_another_seed_is_refused(run):
    done = learn("done", "--resume", "--seed", 9)
    assert done.exit_code == 2
    assert "another --seed" in lines(done)[-1]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("learn", "--scenario", "papr", "--out", "x"), "papr"),
        (("learn", "--epochs", "0"), "--epochs"),
        (("report", "absent"), "error: absent: expected a run folder"),
        (("evaluate", "absent"), "error: absent: expected a run folder"),
        (("explain", "absent"), "error: absent: expected a run folder"),
        (("bench", "learning", "absent"), "absent"),
    ],
)
def test_bad_usage_is_told_in_words_with_exit_code_2(arguments, told):
    done = autotelic(*arguments)
    assert done.exit_code == 2
    assert told in done.output
    assert "Traceback" not in done.output


def test_evaluate_gives_what_the_runs_own_evaluation_gave(run):
    done = autotelic("evaluate", "done", "--tests", 1, "--json")
    assert done.exit_code == 0, done.output
    rows = json.loads(done.stdout)["rows"]
    own = [row for row in RunFolder(run[0]).evaluations() if row.epoch == 4]
    assert [EvaluationRow(**row) for row in rows] == own
    table = autotelic("evaluate", "done", "--tests", 1, "--seed", 5)
    assert table.exit_code == 0
    assert "red_grabbed" in table.stdout


def test_evaluate_without_a_checkpoint_fails_in_one_line(run, tmp_path):
    for name in ("config.yaml", "run.json"):
        (tmp_path / name).write_bytes((run[0] / name).read_bytes())
    done = autotelic("evaluate", tmp_path)
    assert done.exit_code == 1
    assert lines(done)[-1].startswith("error: no readable checkpoint")


@pytest.mark.parametrize("command", [("explain",), ("evaluate",), ("learn", "--resume", "--out")])
def test_a_checkpoint_of_another_version_fails_in_one_line(run, tmp_path, command):
    old = tmp_path / "old"
    shutil.copytree(run[0], old)
    newest = max((old / "checkpoints").iterdir())
    state = decode(newest.read_bytes())
    del state["agent"]["subgoal_selector"]["graph"]["revisions"]
    for path in (old / "checkpoints").iterdir():
        path.write_bytes(encode(state))
    done = autotelic(*command, old)
    assert done.exit_code == 1
    assert "Traceback" not in done.output
    assert "expected a checkpoint as this version keeps it" in lines(done)[-1]
    assert "'revisions'" in lines(done)[-1]


def test_explain_tells_every_goals_needs_and_plan(run):
    done = autotelic("explain", "done", "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert [entry["goal"] for entry in told["explanations"]] == list(range(len(told["goals"])))
    table = autotelic("explain", "done")
    assert table.exit_code == 0
    assert "nothing" in table.stdout
    assert [name for name in told["goals"] if name not in table.stdout] == []  # none is cut


def test_explain_of_a_learner_without_a_graph_fails_in_one_line(folder):
    (folder / "q.yaml").write_text((folder / "fast.yaml").read_text() + "subgoal_selection: {kind: q}\n")
    assert learn("without", "--preset", "q.yaml", "--epochs", 1).exit_code == 0
    done = autotelic("explain", "without")
    assert done.exit_code == 1
    assert lines(done) == ["error: without: expected a run whose sub-goal selector is graph, it is q"]


def test_report_compares_runs_and_writes_where_it_is_told(folder, tmp_path):
    for name, seed, learner in (("a", 5, "toy"), ("b", 6, "toy"), ("c", 5, "other")):
        make_toy_folder(tmp_path / "sweep" / name, seed=seed, learner=learner)
    done = autotelic("report", tmp_path / "sweep", "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert set(report) == set(Report.__struct_fields__)
    assert [(group["name"], group["seeds"]) for group in report["groups"]] == [("toy", [5, 6]), ("other", [5])]
    assert (tmp_path / "out" / "figure2.png").is_file()
    table = autotelic("report", tmp_path / "sweep" / "a")
    assert table.exit_code == 0
    assert (tmp_path / "sweep" / "a" / "figures" / "figure2.pdf").is_file()


def test_a_damaged_run_in_a_folder_of_runs_is_named_and_left_out_of_the_report(tmp_path):
    for name, seed in (("a", 5), ("b", 6), ("c", 7)):
        make_toy_folder(tmp_path / "sweep" / name, seed=seed)
    manifest = tmp_path / "sweep" / "b" / "run.json"
    manifest.write_bytes(manifest.read_bytes()[:200])
    done = autotelic("report", tmp_path / "sweep", "--out", tmp_path / "out", "--json")
    assert done.exit_code == 1
    assert [group["seeds"] for group in json.loads(done.stdout)["groups"]] == [[5, 7]]
    assert (tmp_path / "out" / "figure2.png").is_file()
    assert len(lines(done)) == 1
    assert lines(done)[0].startswith(f"error: left out: {manifest}: expected the JSON object that a run begins with")
    assert "got 200 bytes that break off" in lines(done)[0]
    assert "bring the file back from a copy" in lines(done)[0]


def test_the_bench_names_what_it_leaves_out_and_passes_over_and_judges_the_rest(tmp_path):
    for name, seed in (("a", 5), ("b", 6), ("c", 7)):
        make_toy_folder(tmp_path / "sweep" / name, seed=seed)
    (tmp_path / "sweep" / "a" / "goals.csv").write_text("epoch\n")
    (tmp_path / "sweep" / "b" / "config.yaml").unlink()
    assert autotelic("report", tmp_path / "sweep" / "c", "--out", tmp_path / "sweep" / "report").exit_code == 0
    benched = autotelic("bench", "learning", tmp_path / "sweep", "--json")
    reported = autotelic("report", tmp_path / "sweep", "--out", tmp_path / "out")
    assert [line.split(": expected")[0] for line in lines(benched)] == [
        f"error: left out: {tmp_path / 'sweep' / 'b'}",
        f"error: left out: {tmp_path / 'sweep' / 'a' / 'goals.csv'}",
        f"passed over: {tmp_path / 'sweep' / 'report'}: holds summary.json, but no run",
    ]
    assert lines(reported) == lines(benched)
    assert (benched.exit_code, reported.exit_code) == (1, 1)
    rows = {row["name"]: row for row in json.loads(benched.stdout)["results"]}
    assert (rows["runs"]["value"], rows["runs_left_out"]["value"], rows["runs_left_out"]["ok"]) == (1, 2, False)
    alone = json.loads(autotelic("bench", "learning", tmp_path / "sweep" / "c", "--json").stdout)["results"]
    assert [row for row in alone if not row["name"].startswith("runs")] == [
        row for name, row in rows.items() if not name.startswith("runs")
    ]


def test_a_folder_of_damaged_runs_only_is_reported_run_by_run_and_draws_nothing(tmp_path):
    for name in ("a", "b"):
        make_toy_folder(tmp_path / "sweep" / name)
        (tmp_path / "sweep" / name / "goals.csv").write_text("epoch\n")
    done = autotelic("report", tmp_path / "sweep", "--out", tmp_path / "out")
    assert (done.exit_code, done.stdout) == (1, "")
    assert [line.split(": expected")[0] for line in lines(done)] == [
        f"error: left out: {tmp_path / 'sweep' / name / 'goals.csv'}" for name in ("a", "b")
    ]
    assert not (tmp_path / "out").exists()


def test_a_damaged_run_that_was_named_itself_is_an_error(tmp_path):
    for name in ("a", "b"):
        make_toy_folder(tmp_path / name)
    (tmp_path / "b" / "run.json").write_text('{"format": 1}')
    done = autotelic("report", tmp_path / "a", tmp_path / "b", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert lines(done)[0].startswith(f"error: {tmp_path / 'b' / 'run.json'}: expected the JSON object")
    assert "13 bytes that are not that (Object missing required field `seed`)" in lines(done)[0]
    assert not (tmp_path / "out").exists()


def test_the_bench_reads_the_run_given_or_the_newest(folder, tmp_path):
    make_toy_folder(tmp_path / "run", seed=5)
    done = autotelic("bench", "learning", tmp_path / "run", "--json")
    names = [row["name"] for row in json.loads(done.stdout)["results"]]
    assert {"epoch_all_goals", "epochs_to_recover", "trials_over_optimum", "time_steps_to_all"} <= set(names)
    none = autotelic("bench", "learning")
    assert none.exit_code == 2
    make_toy_folder(folder / "runs" / "newest", seed=5)
    newest = autotelic("bench", "learning", "--json")
    assert json.loads(newest.stdout)["results"] == json.loads(done.stdout)["results"]


def test_ctrl_c_stops_at_an_epochs_end_and_resuming_gives_the_uninterrupted_run(run, folder):
    options = ["--rig", "fake", "--preset", "fast.yaml", "--workers", "1"]
    command = [sys.executable, "-c", "from robot.cli import main; main()", "learn", *options]
    long = ["--epochs", "16", "--seed", "0"]
    with subprocess.Popen(
        [*command, *long, "--out", "stopped"], cwd=folder, stderr=subprocess.PIPE, text=True
    ) as process:
        goals = folder / "stopped" / "goals.csv"
        while not goals.exists() or len(goals.read_bytes().splitlines()) < 4:
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "stopping after this epoch" in said
    assert "go on with: autotelic learn --resume --out stopped" in said
    n_done = len(goals.read_bytes().splitlines()) - 1
    assert 3 <= n_done < 16
    resumed = autotelic("learn", "--resume", "--out", "stopped")
    assert resumed.exit_code == 0, resumed.output
    whole = learn("unbroken", *long)
    assert whole.exit_code == 0
    for name in TABLES:
        assert (folder / "stopped" / name).read_bytes() == (folder / "unbroken" / name).read_bytes()
