"""Runs side by side: figures of merit by hand, and pictures that hold what they should."""

import io
import json
import math

import msgspec
import numpy as np
import pytest
from rich.console import Console

from learning.bench import learning_results
from learning.errors import RunFolderError
from learning.figure_style import save, styles
from learning.figures import curriculum_figure, performance_figure
from learning.report import Report, count, group_runs, load_run, load_runs, report_of
from learning.statistics import Interval
from learning.telling import report_table, report_tables, summary_lines
from tests.support.toy_folder import make_started_toy_folder, make_toy_folder, toy_manifest


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two seeds of one learner and one of another."""
    root = tmp_path_factory.mktemp("runs")
    names = (("a", 5, "toy"), ("b", 6, "toy"), ("c", 5, "other"))
    return [load_run(make_toy_folder(root / name, seed=seed, learner=learner)) for name, seed, learner in names]


def test_a_goal_that_the_run_has_not_is_refused_in_words(tmp_path):
    folder = make_toy_folder(tmp_path)
    for name, goal in (("goals", "9"), ("evaluations", "-1")):
        path = tmp_path / f"{name}.csv"
        whole = path.read_text()
        head, row, *rest = whole.splitlines()
        at = head.split(",").index("goal")
        cells = row.split(",")
        path.write_text("\n".join([head, ",".join([*cells[:at], goal, *cells[at + 1 :]]), *rest, ""]))
        with pytest.raises(RunFolderError, match=rf"{name}\.csv: line 2: expected a goal from 0 to 3, got {goal}"):
            load_run(folder)
        path.write_text(whole)


def test_an_epoch_out_of_turn_is_refused_in_words(tmp_path):
    folder = make_toy_folder(tmp_path)
    path = tmp_path / "goals.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:3], *lines[4:]]))
    with pytest.raises(RunFolderError, match=r"goals\.csv: line 4: expected epoch 2, got 3"):
        load_run(folder)


def test_a_colour_that_is_none_is_refused_in_words(tmp_path):
    folder = make_toy_folder(tmp_path)
    manifest = tmp_path / "run.json"
    manifest.write_text(manifest.read_text().replace("0.95", "1.95"))
    with pytest.raises(RunFolderError, match=r"bytes that are not that .*colour"):
        load_run(folder)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda tree: tree["optima"].pop(), r"expected optima for 2 sets of rules \(changes: 1\), got 1"),
        (lambda tree: tree["optima"].append(tree["optima"][0]), r"expected optima for 2 sets of rules .*, got 3"),
        (lambda tree: tree["changes"].append(90), r"expected optima for 3 sets of rules \(changes: 2\), got 2"),
        (lambda tree: tree["optima"][1].pop(), r"expected optima of 4 goals in optima\[1\], got 3"),
    ],
)
def test_optima_that_are_not_of_the_runs_rules_and_goals_are_refused_in_words(tmp_path, change, told):
    folder = make_started_toy_folder(tmp_path)
    manifest = tmp_path / "run.json"
    tree = json.loads(manifest.read_text())
    change(tree)
    manifest.write_text(json.dumps(tree))
    with pytest.raises(RunFolderError, match=rf"run\.json: {told}$"):
        load_run(folder)


def test_a_run_that_is_named_twice_counts_once(tmp_path):
    folder = make_started_toy_folder(tmp_path / "a").path
    loaded = load_runs([tmp_path, folder])
    assert [run.folder for run in loaded.runs] == [str(folder)]
    assert loaded.left_out == ()
    assert loaded.lines() == [f"passed over: {folder}: named before, counted once"]


def with_manifest(run, **changes):
    return msgspec.structs.replace(run, manifest=msgspec.structs.replace(run.manifest, **changes))


def with_era(run, index, **changes):
    eras = list(run.summary.eras)
    eras[index] = msgspec.structs.replace(eras[index], **changes)
    return msgspec.structs.replace(run, summary=msgspec.structs.replace(run.summary, eras=tuple(eras)))


def test_runs_are_grouped_by_learner_in_the_order_they_came(runs):
    groups = group_runs(runs)
    assert [(group.name, [run.manifest.seed for run in group.runs]) for group in groups] == [
        ("toy", [5, 6]),
        ("other", [5]),
    ]
    mixed = group_runs([runs[0], with_manifest(runs[2], scenario="lights")])
    assert [group.name for group in mixed] == ["toy, lamps", "other, lights"]


def test_a_learners_name_is_shown_letter_by_letter(runs):
    text = io.StringIO()
    table = report_table(report_of(group_runs([with_manifest(runs[0], learner="[/v2] :heart:")])))
    Console(file=text, width=200).print(table)
    assert "[/v2] :heart:" in text.getvalue()


def test_runs_of_one_learner_with_other_changes_are_refused(runs):
    with pytest.raises(RunFolderError, match="expected the goals and changes"):
        group_runs([runs[0], with_manifest(runs[1], changes=(30,))])


def test_figures_over_runs_are_median_and_range(runs):
    first, second = (with_era(run, 0, learnt_after=after) for run, after in zip(runs[:2], (10, 30), strict=True))
    era = report_of(group_runs([first, second])).groups[0].eras[0]
    assert (era.learnt_after.median, era.learnt_after.least, era.learnt_after.greatest) == (20, 10, 30)
    assert (era.learnt.n, era.learnt.of) == (2, 2)
    never = report_of(group_runs([with_era(first, 0, learnt_after=None), second])).groups[0].eras[0]
    assert (never.learnt.n, never.learnt.of, never.learnt_after.n, never.learnt_after.of) == (1, 2, 1, 2)


def cells(report, heading):
    """Return what a column of the report's table holds, a string a row."""
    (column,) = (column for column in report_table(report).columns if str(column.header).startswith(heading))
    return [str(cell) for cell in column.cells]


def test_a_figure_of_fewer_than_all_runs_says_of_how_many_in_table_and_json(runs):
    first, second, third = (
        with_era(msgspec.structs.replace(runs[0], folder=str(i)), 0, graph_right_after=after, learnt_after=20)
        for i, after in enumerate((10, 30, None))
    )
    report = report_of(group_runs([first, second, third]))
    told = json.loads(msgspec.json.encode(report))["groups"][0]["eras"][0]
    assert told["graph_right_after"] == {"median": 20.0, "least": 10, "greatest": 30, "n": 2, "of": 3, "middle": None}
    assert (told["graph_right"]["n"], told["graph_right"]["of"], told["learnt_after"]["n"]) == (2, 3, 3)
    assert (cells(report, "graph")[0], cells(report, "after")[0]) == ("20\n10–30\n2 of 3\nruns", "20\n20–20")
    never = report_of(group_runs([with_era(run, 0, graph_right_after=None) for run in (first, second, third)]))
    told = json.loads(msgspec.json.encode(never))["groups"][0]["eras"][0]
    assert told["graph_right_after"] == {
        "median": None,
        "least": None,
        "greatest": None,
        "n": 0,
        "of": 3,
        "middle": None,
    }
    assert cells(never, "graph")[0] == "–\n0 of 3\nruns"
    slow = report_of(group_runs([first, second, with_era(third, 0, graph_right_after=40, learnt_after=None)]))
    assert (cells(slow, "graph")[0], cells(slow, "after")[0]) == ("30\n10–40", "20\n20–20\n2 of 3\nruns")


def test_a_learner_without_a_graph_has_none_that_was_never_right(runs):
    without = [with_era(run, 0, graph_right_after=None, graph_wrong_last=None) for run in runs[:2]]
    report = report_of(group_runs(without))
    assert report.groups[0].eras[0].graph_right is None
    assert cells(report, "graph")[0] == "–"


def test_runs_that_are_yet_to_come_to_a_set_of_rules_are_told(runs):
    summary = runs[1].summary
    early = msgspec.structs.replace(runs[1], summary=msgspec.structs.replace(summary, eras=summary.eras[:1]))
    report = report_of(group_runs([runs[0], early]))
    assert [(era.from_epoch, era.n_runs) for era in report.groups[0].eras] == [(0, 2), (60, 1)]
    assert cells(report, "rules") == ["0", "60\n1 of 2\nruns"]
    rows = {row.name: row for row in learning_results([runs[0], early])}
    assert (rows["epochs_to_recover"].ok, rows["epochs_to_recover"].details) == (False, {"over": "1 of 2"})
    assert rows["epoch_all_goals"].details is msgspec.UNSET
    begun = msgspec.structs.replace(early, summary=msgspec.structs.replace(summary, eras=()))
    assert {row.name: row for row in learning_results([runs[0], begun])}["epoch_all_goals"].details == {
        "over": "1 of 2"
    }


def test_wilsons_interval_of_five_in_five_and_none_in_ten():
    five = count(5, 5)
    assert (five.share_low, five.share_high) == (pytest.approx(0.5655, abs=1e-4), 1.0)
    none = count(0, 10)
    assert (none.share_low, none.share_high) == (0.0, pytest.approx(0.2775, abs=1e-4))
    assert (count(0, 0).share_low, count(0, 0).share_high) == (0.0, 1.0)


def test_a_report_reads_back_from_its_json(runs):
    report = report_of(group_runs(runs))
    assert msgspec.json.decode(msgspec.json.encode(report), type=Report) == report


def test_the_performance_figure_holds_every_goal_in_both_panels_and_marks_the_change(runs):
    groups = group_runs(runs)
    figure = performance_figure(groups)
    panels = figure.get_axes()
    assert len(panels) == 2 * len(groups)
    for panel in panels:
        goal_lines = [line for line in panel.get_lines() if line.get_label().startswith("lamp")]
        assert len(goal_lines) == 4
        assert any(list(line.get_xdata()) == [60, 60] for line in panel.get_lines())
    shown = panels[0].get_lines()
    last = next(line for line in shown if line.get_label() == "lamp 0")
    assert last.get_ydata()[-1] == runs[0].evaluation_rows[-4].success


def test_every_goal_is_told_apart_by_colour_and_by_dash_or_marker():
    drawn = styles(toy_manifest().goals)
    assert len({style.colour for style in drawn}) == len(drawn)
    assert len({(style.dash, style.marker) for style in drawn}) == len(drawn)
    assert drawn[0].colour == pytest.approx((0.90, 0.62, 0.0), abs=0.01)  # the palette's orange


def test_figures_are_written_in_every_format_with_the_same_bytes_each_time(runs, tmp_path):
    groups = group_runs(runs)
    for name, make in (("figure2", performance_figure), ("curriculum", curriculum_figure)):
        saved = save(make(groups), tmp_path / "one", name)
        first = [path.read_bytes() for path in saved]
        again = [path.read_bytes() for path in save(make(groups), tmp_path / "two", name)]
        assert [path.suffix for path in saved] == [".png", ".pdf", ".svg"]
        assert first == again


def test_a_run_that_has_only_begun_can_be_drawn(runs, tmp_path):
    begun = msgspec.structs.replace(runs[0], goal_rows=(), evaluation_rows=())
    save(performance_figure(group_runs([begun])), tmp_path, "figure2")
    save(curriculum_figure(group_runs([begun])), tmp_path, "curriculum")


def test_words_say_what_was_reached_and_what_was_not(runs):
    run = with_era(runs[0], 1, learnt_after=None, graph_right_after=20, trials_over_optimum=0.125)
    lines = list(summary_lines(run))
    assert "120 epochs" in lines[0]
    assert "learnt after" in lines[1]
    assert "rules changed at epoch 60: recovered not yet, graph right after 20" in lines[2]
    assert "0.12 trials over the optimum (goal with most: " in lines[2]
    wrong = with_era(runs[0], 0, graph_right_after=None, graph_wrong_last=(24, 1008))
    assert "graph never right (24 of 1008 predictions wrong at last)" in list(summary_lines(wrong))[1]
    assert report_table(report_of(group_runs(runs))).row_count == 4


def test_bench_rows_ask_the_goal_of_the_worst_run(runs):
    good = [with_era(with_era(run, 0, learnt_after=40), 1, learnt_after=50, graph_right_after=30) for run in runs]
    rows = {row.name: row for row in learning_results(good)}
    assert (rows["epoch_all_goals"].value, rows["epoch_all_goals"].ok) == (40, True)
    assert (rows["epochs_to_recover"].value, rows["epochs_to_recover"].goal) == (50, "<= 100")
    slow = [*good[:2], with_era(good[2], 1, learnt_after=101)]
    assert not {row.name: row for row in learning_results(slow)}["epochs_to_recover"].ok
    never = [*good[:2], with_era(good[2], 1, graph_right_after=None)]
    row = {row.name: row for row in learning_results(never)}["graph_right_after_epochs"]
    assert (row.value, row.ok, row.details) == (30, False, {"over": "2 of 3"})
    assert math.isnan({row.name: row for row in learning_results([])}["epoch_all_goals"].value)


def test_three_runs_have_interquartile_means_with_intervals_and_two_learners_a_probability(runs):
    ours = [with_era(run, 0, trials_over_optimum=0.1 * i) for i, run in enumerate([runs[0]] * 3)]
    theirs = [
        with_manifest(with_era(run, 0, trials_over_optimum=1.0 + i), learner="slow")
        for i, run in enumerate([runs[0]] * 4)
    ]
    report = report_of(group_runs([*ours, *theirs]), rng=np.random.default_rng(0))
    middle = report.groups[0].eras[0].trials_over_optimum.middle
    assert middle.value == pytest.approx(0.1)
    assert 0.0 <= middle.low < middle.value < middle.high <= 0.2 + 1e-9
    assert (report.comparisons[0].ours, report.comparisons[0].theirs) == ("toy", "slow")
    assert report.comparisons[0].trials == Interval(value=1.0, low=1.0, high=1.0)
    assert report.comparisons[0].success.value == 0.5
    text = io.StringIO()
    Console(file=text, width=200).print(*report_tables(report))
    assert "0.10 [" in text.getvalue()
    assert "needs fewer trials" in text.getvalue()
    assert "100% [100, 100%]" in text.getvalue()


def test_what_not_every_run_has_and_what_two_runs_have_gets_no_interval(runs):
    three = [runs[0], runs[0], with_era(runs[0], 0, learnt_after=None)]
    era = report_of(group_runs(three), rng=np.random.default_rng(0)).groups[0].eras[0]
    assert era.learnt_after.middle is None
    assert era.trials_over_optimum.middle is not None
    two = report_of(group_runs(runs[:2]), rng=np.random.default_rng(0))
    assert two.groups[0].eras[0].trials_over_optimum.middle is None
    assert len(report_tables(two)) == 1
