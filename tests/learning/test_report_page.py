"""Learners side by side, and a page that stands alone."""

import base64
import re
from xml.etree import ElementTree

import msgspec
import numpy as np
import pytest

from config.loader import load_learning
from learning import figure_style
from learning.curves import over_optimum_curve, success_curve
from learning.figures_compared import epochs_figure, improvement_figure, learners_figure
from learning.page import differences
from learning.report import group_runs, load_run, report_of
from learning.report_files import write_report
from learning.statistics import iqm
from tests.support.toy_folder import make_toy_folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Three seeds of one learner and three of another that never does as well."""
    root = tmp_path_factory.mktemp("runs")
    first = [load_run(make_toy_folder(root / str(seed), seed=seed)) for seed in (5, 6)]
    first.append(msgspec.structs.replace(first[0], folder="again"))
    return [*first, *(_hopeless(run) for run in first)]


def _hopeless(run):
    rows = tuple(
        msgspec.structs.replace(row, n_successes=0, trials_achieved=0, trials_all=run.manifest.n_trials * row.n_tests)
        for row in run.evaluation_rows
    )
    eras = tuple(msgspec.structs.replace(era, learnt_after=None) for era in run.summary.eras)
    manifest = msgspec.structs.replace(run.manifest, learner="<hopeless>")
    summary = msgspec.structs.replace(run.summary, eras=eras)
    return msgspec.structs.replace(run, evaluation_rows=rows, manifest=manifest, summary=summary)


def test_a_curve_is_the_middle_of_all_goals_and_runs_within_its_interval(runs):
    ours, hopeless = group_runs(runs)
    curve = success_curve(ours)
    rows = [[row for row in run.evaluation_rows if row.epoch == curve.epochs[-1]] for run in ours.runs]
    assert curve.values[-1] == pytest.approx(iqm(np.array([row.success for part in rows for row in part])))
    for low, value, high in zip(curve.lows, curve.values, curve.highs, strict=True):
        assert low <= value <= high
    assert set(success_curve(hopeless).values) == {0.0}
    best = [n for n in hopeless.runs[0].manifest.optima[0] if n is not None]
    failed = hopeless.runs[0].manifest.n_trials
    assert over_optimum_curve(hopeless).values[0] == pytest.approx(failed - iqm(np.array(best * 3, dtype=float)))


def test_what_half_of_the_runs_never_learnt_has_no_point_in_the_figure(runs):
    report = report_of(group_runs(runs), rng=np.random.default_rng(0))
    assert report.groups[1].eras[0].learnt_by_half.value is None
    (axes,) = epochs_figure(report).get_axes()
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names[0] == "toy, from 0"
    at = names.index("<hopeless>, from 0")
    assert not [line for line in axes.get_lines() if list(line.get_ydata()) == [at] and line.get_marker() != ">"]
    assert [line for line in axes.get_lines() if list(line.get_ydata()) == [0]]
    told = {text.get_text() for text in axes.texts}
    assert "0/3" in told


def test_the_first_learner_is_drawn_against_the_others(runs):
    groups = group_runs(runs)
    report = report_of(groups, rng=np.random.default_rng(0))
    left, _ = improvement_figure(report.comparisons).get_axes()
    assert left.get_yticklabels()[0].get_text() == "toy over <hopeless>, from 0"
    lines = [line.get_label() for line in learners_figure(groups).get_axes()[0].get_lines()]
    assert "toy (3)" in lines


def test_the_page_stands_alone_with_every_figure_in_it(runs, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_style, "FORMATS", ("svg",))
    config = {"toy": load_learning("default"), "<hopeless>": load_learning("no_hazard")}
    write_report(runs, tmp_path, learners=config)
    page = (tmp_path / "report.html").read_text()
    assert not re.search(r"""(?:src|href|url)\s*[=(]\s*["']?\s*(?:https?:|//|file:)""", page)
    assert "<script" not in page
    assert "<hopeless>" not in page
    assert "&lt;hopeless&gt;" in page
    assert "subgoal_selection.hazard" in page
    figures = re.findall(r'<img alt="([^"]+)" src="data:image/svg\+xml;base64,([^"]+)"', page)
    assert len(figures) == 5
    for alt, figure in figures:
        assert alt
        assert ElementTree.fromstring(base64.b64decode(figure)).tag.endswith("svg")


def test_what_a_preset_changes_is_told_key_by_key():
    told = differences(load_learning("no_hazard"), load_learning("default"))
    assert any(line.startswith("subgoal_selection.hazard 0.0 (not 0.002)") for line in told)
    assert differences(load_learning("default"), load_learning("default")) == []
