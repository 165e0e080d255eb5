import msgspec
import pytest
from rich.console import Console

from learning.figure_style import save
from learning.report import count
from learning.robustness.cases import CASES
from learning.robustness.figure import robustness_figure
from learning.robustness.result import CaseResult, Plan, Robustness, bearing_of
from learning.robustness.telling import robustness_table
from learning.rows import EvaluationRow, GraphRow
from learning.run_folder import GoalInfo

PLAN = Plan(
    learner="default", scenario="paper", run_seed=3, config_sha256="", n_done=300, n_tests=20, n_more=50, seed=3
)
GOALS = tuple(GoalInfo(name=f"goal_{i}", kind="pressed", colour=(0.1 * i, 0.4, 0.2)) for i in range(8))


def row(goal, n_successes, *, n_void=0, wrong=0):
    return EvaluationRow(
        epoch=300, rules_epoch=299, goal=goal, n_tests=20 - n_void, n_successes=n_successes, n_void=n_void,
        trials_achieved=n_successes, trials_all=20, n_steps=100, graph_cases=24, graph_wrong=wrong,
    )  # fmt: skip


def look(epoch, n_wrong):
    return GraphRow(epoch=epoch, rules_epoch=epoch - 1, n_cases=144, n_wrong=n_wrong)


def result_of(case, successes, **how):
    rows = tuple(row(goal, successes, **how) for goal in reversed(range(len(GOALS))))
    looks = (look(310, 0), look(320, 2), look(330, 1))
    return CaseResult(case=case.name, before=rows, after=rows, looks=looks, n_void=0)


@pytest.fixture(scope="module")
def told():
    cases = tuple(bearing_of(case, result_of(case, 20 - i)) for i, case in enumerate(CASES))
    return Robustness(plan=PLAN, goals=GOALS, cases=cases)


def test_shares_are_of_all_test_epochs_those_cut_short_among_them():
    told = bearing_of(CASES[1], result_of(CASES[1], 15, n_void=2, wrong=3))
    assert told.before == told.after == (count(15, 20),) * 8
    assert told.graph_before == (24, 192)
    assert (told.looks.n, told.looks.n_right, told.looks.n_wrong_last, told.looks.n_cases) == (3, 1, 1, 144)


def test_goals_are_in_their_order_whatever_order_they_were_tested_in():
    rows = tuple(row(goal, goal) for goal in (3, 0, 2, 1))
    told = bearing_of(CASES[0], CaseResult(case="nominal", before=rows, after=(), looks=(), n_void=0))
    assert [entry.n for entry in told.before] == [0, 1, 2, 3]
    assert told.after == ()
    assert told.looks is None


def test_a_learner_without_a_graph_has_none_that_could_be_right():
    rows = (msgspec.structs.replace(row(0, 5), graph_cases=None, graph_wrong=None),)
    told = bearing_of(CASES[0], CaseResult(case="nominal", before=rows, after=(), looks=(), n_void=0))
    assert told.graph_before is None


def test_the_table_tells_every_case_and_every_goal(told):
    console = Console(width=200, record=True, file=None, force_terminal=False)
    with console.capture() as captured:
        console.print(robustness_table(told))
    text = captured.get()
    assert all(case.says in text for case in CASES)
    assert text.count("20/20") == 16  # a case before and after, eight goals
    assert "1 of 144, right at 1 of 3 looks" in text


@pytest.mark.slow
def test_the_figure_is_drawn_in_vectors_too_and_always_the_same(told, tmp_path):
    once, again = (save(robustness_figure(told), tmp_path / name, "robustness") for name in "ab")
    assert [path.suffix for path in once] == [".png", ".pdf", ".svg"]
    assert [path.read_bytes() for path in once] == [path.read_bytes() for path in again]
    svg = once[2].read_text()
    assert len(svg) > 10_000


def test_the_figure_shows_what_was_counted(told):
    figure = robustness_figure(told)
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert len(panels) == 8
    for goal, axes in enumerate(panels):
        points = [line for line in axes.lines if len(line.get_xdata()) == len(CASES)]
        assert [list(line.get_xdata()) for line in points] == [[(20 - i) / 20 for i in range(len(CASES))]] * 2, goal
