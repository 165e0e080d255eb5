import os
import shutil
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from config.loader import resolve
from config.resolved import dump_resolved
from config.yaml_text import dump_yaml
from learning.errors import LearningError
from learning.film.filming import _Filming
from learning.film.relive import Reliving
from learning.film.sheet import SIZE_PX
from learning.report import load_run
from learning.run_folder import RunFolder
from learning.wanted import Wanted
from robot.cli import app
from robot.recording.images import opencv
from tests.support.quiet_run import learn_quietly
from tests.support.toy_folder import toy_manifest

QUICK = "base: default\nname: quick\nexperiment: {epochs: 6, trials: 3, steps: 8, evaluate_every: 3, test_epochs: 1}\n"
CHANGE = 3


def autotelic(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("film")
    scenario = resolve().scenario
    first, second = scenario.schedule
    early = msgspec.structs.replace(scenario, schedule=(first, msgspec.structs.replace(second, from_epoch=CHANGE)))
    (path / "early.yaml").write_text(dump_yaml(msgspec.to_builtins(early)))
    (path / "quick.yaml").write_text(QUICK)
    return path


@pytest.fixture(scope="module")
def run(folder):
    wanted = Wanted(scenario=str(folder / "early.yaml"), preset=str(folder / "quick.yaml"), seed=4)
    return learn_quietly(folder / "run", wanted)[0]


@pytest.fixture
def reliving(run):
    made = Reliving(run)
    yield made
    made.close()


def test_what_is_learnt_before_a_change_is_kept_for_good(run):
    kept = run.path / "milestones" / f"checkpoint-{CHANGE:08d}.zip"
    assert kept.is_file()
    assert run.checkpoints.before(CHANGE)["n_done"] == CHANGE
    assert run.checkpoints.before(CHANGE - 1)["n_done"] == 0
    assert run.checkpoints.newest()[0]["n_done"] == 6


def test_epochs_live_again_as_the_tables_tell_in_whatever_order(run, reliving):
    for epoch in (4, 0, 3, 5, 1):
        shots = reliving.live(epoch)
        row = run.goals()[epoch]
        steps = sum(t.n_steps for t in run.trials() if t.epoch == epoch)
        assert {shot.epoch for shot in shots} == {epoch}
        assert shots[-1].goal == row.goal
        assert len(shots) >= steps  # the reset, and rising between trials, are shown too
        assert shots[-1].ended == (
            f"achieved in {row.n_trials} trial{'s' * (row.n_trials != 1)}" if row.is_achieved
            else f"not achieved in {row.n_trials} trials"
        )  # fmt: skip
        tried = [t.subgoal for t in run.trials() if t.epoch == epoch]
        assert list(dict.fromkeys((s.trial, s.subgoal) for s in shots if s.subgoal is not None)) == list(
            enumerate(tried, 1)
        )


def test_a_test_changes_nothing_of_what_is_lived_after_it(run, reliving):
    reliving.test(CHANGE, rules_epoch=CHANGE - 1, goal=0)
    assert reliving.live(CHANGE)
    shots = reliving.test(6, rules_epoch=5, goal=2)
    assert shots[-1].ended
    assert {shot.goal for shot in shots} == {2}


def test_a_run_that_does_not_come_to_what_its_table_tells_is_not_filmed(run, tmp_path):
    other = RunFolder(Path(shutil.copytree(run.path, tmp_path / "other")))
    rows = (other.path / "goals.csv").read_text().splitlines()
    rows[2] = rows[2].rsplit(",", 1)[0] + ",1"
    (other.path / "goals.csv").write_text("\n".join(rows) + "\n")
    made = Reliving(other)
    try:
        with pytest.raises(LearningError, match=r"epoch 1: expected to live again what goals\.csv tells"):
            made.live(2)
    finally:
        made.close()


def test_the_film_is_a_minute_of_pictures_of_one_size(run):
    def draw(state, percept):
        return np.full((720, 960, 3), int(100 * abs(state.q_rad[0])) % 256, np.uint8)

    reliving, said = Reliving(run), []
    try:
        film = _Filming(load_run(run), reliving, draw, rate_hz=1.0, tell=said.append)
        pictures = list(film.pictures())
    finally:
        reliving.close()
    assert 57 <= len(pictures) <= 63
    assert {picture.shape for picture in pictures} == {(SIZE_PX[1], SIZE_PX[0], 3)}
    assert sum("drawing scene" in line for line in said) >= 7
    assert len({picture.tobytes() for picture in pictures}) > 15


@pytest.mark.gl
@pytest.mark.slow
def test_the_command_writes_a_video(run, tmp_path):
    out = tmp_path / "run.mp4"
    done = subprocess.run(
        [sys.executable, "-c", "from robot.cli import main; main()", "film", str(run.path), "--out", str(out),
         "--rate", "1"],
        env=os.environ | {"MUJOCO_GL": "egl"}, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    if "expected an off-screen GL" in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stderr
    video = opencv().VideoCapture(str(out))
    assert 57 <= video.get(7) <= 63
    assert (video.get(3), video.get(4)) == SIZE_PX


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("absent",), 2, "expected a run folder"),
        (("absent", "--out", "run.gif"), 2, "expected a file whose name ends in .mp4"),
    ],
)
def test_bad_usage_is_told_in_words(words, code, told):
    done = autotelic("film", *words)
    assert done.exit_code == code
    assert told in done.output


def test_a_run_on_a_plant_that_is_no_twin_is_refused(tmp_path):
    with RunFolder(tmp_path / "fake") as out:
        out.start(toy_manifest(), dump_resolved(resolve(rig="fake")))
    with pytest.raises(LearningError, match="expected a run on a twin in lock-step"):
        Reliving(out)
