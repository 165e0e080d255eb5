import numpy as np
import pytest

from config.errors import ConfigError
from config.loader import load_sweep
from config.sweep import Sweep
from learning.errors import RunFolderError
from learning.sweeping.cells import cells_of, epochs_done, is_finished, words_of
from learning.sweeping.executor import End
from learning.sweeping.manifest import take_folder
from learning.sweeping.runner import SweepRunner
from learning.sweeping.table import Pace, sweep_table

SWEEP = Sweep(name="small", presets=("default", "paper"), seeds=(3, 4), epochs=40, tries=2)


class DrawnExecutor:
    """Runs cells as a generator draws: each look brings some on, ends some and kills others."""

    def __init__(self, folder, rng, *, n_slots=2, dies=0.3, never=()):
        self.n_slots, self._folder, self._rng, self._dies, self._never = n_slots, folder, rng, dies, never
        self._jobs, self.starts = {}, []
        self.is_asked, self.most = False, 0

    def start(self, job):
        assert job.name not in self._jobs
        self.starts.append(job.name)
        self._jobs[job.name] = job
        self.most = max(self.most, len(self._jobs))

    def ended(self):
        ends = [end for job in [*self._jobs.values()] if (end := self._turn(job)) is not None]
        for end in ends:
            del self._jobs[end.name]
        return ends

    def _turn(self, job):
        folder = self._folder / job.name
        folder.mkdir(exist_ok=True)
        if job.name in self._never or self._rng.random() < self._dies:
            return End(name=job.name, why_failed="killed by SIGKILL: it said nothing")
        at = min(40, come_to(folder) + int(self._rng.integers(1, 9)))
        (folder / "trials.csv").write_text(f"epoch,trial\n{at - 1},1\n")
        if at < 40:
            return End(name=job.name, why_failed="exit code 130: stopped") if self.is_asked else None
        (folder / "summary.json").write_text("{}")
        return End(name=job.name, why_failed=None)

    def ask_to_stop(self):
        self.is_asked = True

    def close(self):
        self._jobs = {}


def come_to(folder):
    table = folder / "trials.csv"
    return int(table.read_text().splitlines()[-1].split(",")[0]) + 1 if table.exists() else 0


def runner_of(folder, rng, sweep=SWEEP, **how):
    executor = DrawnExecutor(folder, rng, **how)
    said = []
    return SweepRunner(take_folder(folder, sweep), folder=folder, executor=executor, tell=said.append), executor, said


def test_a_cell_is_the_command_that_anybody_may_type(tmp_path):
    cell = cells_of(SWEEP)[1]
    assert cell.name == "paper-paper-twin-3"
    assert " ".join(words_of(cell, SWEEP, tmp_path)) == (
        "learn --scenario paper --preset paper --rig twin --seed 3 --epochs 40 --judged "
        f"--out {tmp_path}/paper-paper-twin-3 --workers 0 --resume --json"
    )


@pytest.mark.parametrize("seed", range(10))
def test_every_cell_is_finished_whatever_kills_those_that_come_on(tmp_path, seed):
    runner, executor, _ = runner_of(tmp_path, np.random.default_rng(seed), dies=0.05)
    while not runner.is_over:
        runner.look()
    assert runner.given_up == {}
    assert runner.n_finished == len(cells_of(SWEEP)) == 4
    assert executor.most <= executor.n_slots


def test_a_cell_that_comes_no_further_is_given_up_reported_and_holds_up_no_other(tmp_path):
    runner, executor, said = runner_of(tmp_path, np.random.default_rng(0), dies=0.0, never=("paper-paper-twin-3",))
    while not runner.is_over:
        runner.look()
    assert executor.starts.count("paper-paper-twin-3") == SWEEP.tries
    assert list(runner.given_up) == ["paper-paper-twin-3"]
    assert runner.n_finished == 3
    assert [f.cell for f in take_folder(tmp_path, SWEEP).failures] == ["paper-paper-twin-3"] * SWEEP.tries
    assert any("given up after 2 tries at epoch 0: killed by SIGKILL" in line for line in said)


@pytest.mark.parametrize("seed", range(5))
def test_a_sweep_that_is_taken_up_again_starts_only_what_is_not_finished(tmp_path, seed):
    rng = np.random.default_rng(seed)
    first, _, _ = runner_of(tmp_path, rng, dies=0.0)
    for _ in range(14):
        first.look()
    whole = {cell.name for cell in cells_of(SWEEP) if is_finished(cell, tmp_path)}
    assert whole
    again, executor, _ = runner_of(tmp_path, rng, dies=0.0)
    while not again.is_over:
        again.look()
    assert again.n_finished == 4
    assert not whole & set(executor.starts)


def test_a_stop_starts_nothing_more_and_is_no_failure(tmp_path):
    runner, executor, _ = runner_of(tmp_path, np.random.default_rng(1), dies=0.0)
    runner.look()
    runner.stop()
    while not runner.is_over:
        runner.look()
    assert len(executor.starts) == executor.n_slots
    assert take_folder(tmp_path, SWEEP).failures == ()
    assert runner.given_up == {}


def test_one_that_says_that_all_is_well_and_is_not_done_has_failed(tmp_path):
    runner, executor, said = runner_of(tmp_path, np.random.default_rng(1))
    executor.ended = lambda: [End(name=name, why_failed=None) for name in runner.running]
    executor.start = lambda job: None
    while not runner.is_over:
        runner.look()
    assert len(runner.given_up) == 4
    assert any("before its epochs were done" in line for line in said)


@pytest.mark.parametrize("left", ["", "epoch,trial\n", "epoch,trial\n12", "epoch,trial\nx,1\n", "\x00\xff"])
def test_a_torn_table_tells_no_epochs_and_breaks_nothing(tmp_path, left):
    cell = cells_of(SWEEP)[0]
    (tmp_path / cell.name).mkdir()
    (tmp_path / cell.name / "trials.csv").write_text(left)
    assert epochs_done(cell, tmp_path) == 0


def test_a_folder_of_another_sweep_or_of_something_else_is_refused(tmp_path):
    take_folder(tmp_path, SWEEP)
    with pytest.raises(RunFolderError, match="holds another sweep"):
        take_folder(tmp_path, Sweep(name="small", seeds=(5,)))
    (tmp_path / "sweep.json").write_text("{")
    with pytest.raises(RunFolderError, match="bring it back from a copy"):
        take_folder(tmp_path, SWEEP)
    (tmp_path / "sweep.json").unlink()
    (tmp_path / "holiday.png").touch()
    with pytest.raises(RunFolderError, match=r"found holiday\.png"):
        take_folder(tmp_path, SWEEP)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name: a\nseeds: []\n", "seeds: expected a list of at least 1 and at most 10000 entries"),
        ("name: a\nseeds: [1, 2, 1]\n", "seeds[2]: expected a seed used once"),
        ("name: a\nseeds: [1]\npresets: [one/my.yaml, two/my.yaml]\n", "presets[1]: expected a file's name used once"),
        ("name: a\nseeds: [1]\nepoch: 5\n", "the unknown key 'epoch' (did you mean epochs?)"),
        ("name: a\nseeds: [-1]\n", "seeds[0]: expected a whole number from 0"),
    ],
)
def test_a_wrong_sweep_is_told_by_place(tmp_path, text, expected):
    file = tmp_path / "sweep.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_sweep(file)
    assert expected in str(error.value)


def test_files_that_a_sweep_names_are_paths_from_where_it_lies(tmp_path):
    (tmp_path / "sweep.yaml").write_text("name: a\nseeds: [1]\npresets: [default, mine.yaml]\n")
    assert load_sweep(tmp_path / "sweep.yaml").presets == ("default", str(tmp_path / "mine.yaml"))


def test_a_person_is_told_how_far_all_cells_are_and_how_long_the_rest_takes(tmp_path):
    runner, _, _ = runner_of(tmp_path, np.random.default_rng(1), dies=0.0)
    pace = Pace(runner, n_epochs=40)
    assert pace.left_s(60.0, 0) is None
    runner.look()
    runner.look()
    n_done = pace.n_done
    assert 0 < n_done < pace.n_all == 160
    assert pace.left_s(60.0, n_done) == pytest.approx(60.0 * (160 - n_done) / n_done)
    table = sweep_table(runner, pace, seconds=60.0)
    assert table.title == (
        f"small: 0 of 4 cells, {100 * n_done / 160:.0f} %, about {(160 - n_done) / n_done:.0f} min left"
    )
    assert table.row_count == 2
