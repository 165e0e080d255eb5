"""`autotelic agent`: a course of learning and tests that is kept, stopped and gone on with."""

import msgspec
import pytest
from typer import Typer
from typer.testing import CliRunner

from learning.environments import cli
from learning.environments.cli import agent
from learning.environments.course import Course, Wanted, read_course, run_course

app = Typer()
app.command()(agent)
WANTED = Wanted(agent="flat", scenario="paper", rig="twin", seed=3, epoch=0, n_steps=50, every=20, n_tests=2)
COURSE = Course(wanted=WANTED, goals=("a", "b"))


class Counting:
    """An agent that has learnt goal 0 after 30 time steps, and of whose tests at goal 1 every one is void."""

    def __init__(self, n_steps=0):
        self.n_steps, self.kept, self.seeds = n_steps, [], []

    def learn(self, n_steps, *, should_stop, when_stepped):
        for _ in range(n_steps):
            if should_stop():
                return
            self.n_steps += 1
            when_stepped()

    def test(self, goal, *, seed):
        self.seeds.append(seed)
        return self.n_steps >= 30 and goal == 0, goal == 1, 7

    def keep(self, folder):
        self.kept.append(self.n_steps)


def test_goals_are_tested_every_so_often_and_at_the_end_and_each_test_has_its_own_seed(tmp_path):
    made = Counting()
    course = run_course(made, COURSE, tmp_path, should_stop=lambda: False)
    assert [(score.n_steps, score.n_successes, score.n_void) for score in course.scores] == [
        (20, (0, 0), (0, 2)), (40, (2, 0), (0, 2)), (50, (2, 0), (0, 2)),
    ]  # fmt: skip
    assert made.kept == [20, 40, 50]
    assert len(set(made.seeds)) == len(made.seeds) == 12
    assert read_course(tmp_path) == course


def test_a_course_that_is_stopped_keeps_its_tests_and_goes_on_from_the_last(tmp_path):
    made = Counting()
    stopped = run_course(made, COURSE, tmp_path, should_stop=lambda: made.n_steps >= 33)
    assert [score.n_steps for score in stopped.scores] == [20]
    again = Counting(n_steps=20)
    course = run_course(again, read_course(tmp_path), tmp_path, should_stop=lambda: False)
    assert course == run_course(Counting(), COURSE, tmp_path / "..", should_stop=lambda: False)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("ppo",), "expected one of flat, her"),
        (("her", "--seed", "4"), "holds another course"),
        (("flat", "--scenario", "papier"), "did you mean paper?"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_is(tmp_path, words, why):
    (tmp_path / "course.json").write_bytes(msgspec.json.encode(COURSE))
    result = CliRunner().invoke(app, [*words, "--out", str(tmp_path)], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert why in result.stderr


def test_without_the_library_it_is_told_what_to_install(monkeypatch, tmp_path):
    def missing(name):
        raise ModuleNotFoundError(name, name="stable_baselines3")

    monkeypatch.setattr(cli, "import_module", missing)
    result = CliRunner().invoke(app, ["flat", "--out", str(tmp_path / "out")], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    assert "stable_baselines3 is missing" in result.stderr


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning")
@pytest.mark.parametrize("kind", ["flat", "her"])
def test_an_agent_of_the_library_learns_is_tested_and_goes_on_where_it_was(kind, tmp_path):
    pytest.importorskip("stable_baselines3")
    few = ("--every", "1100", "--tests", "1", "--out", str(tmp_path))
    first = CliRunner().invoke(app, [kind, "--steps", "1100", *few, "--json"])
    assert first.exit_code == 0, first.output
    assert (tmp_path / "model.zip").is_file()
    second = CliRunner().invoke(app, [kind, "--steps", "1120", *few, "--json"])
    assert second.exit_code == 0, second.output
    course = msgspec.json.decode(second.stdout.splitlines()[-1], type=Course)
    assert [score.n_steps for score in course.scores] == [1100, 1120]
    assert course.scores[0] == msgspec.json.decode(first.stdout.splitlines()[-1], type=Course).scores[0]
