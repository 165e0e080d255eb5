"""The learner's part of the bench over the wire: what its rows say, and what it says to a folder that holds no run."""

import msgspec
import pytest
import typer

from learning.rows import EvaluationRow
from learning.wired import success_results, success_rows

GOALS = ("red", "blue")
ROW = EvaluationRow(
    epoch=150, rules_epoch=149, goal=1, n_tests=20, n_successes=19, n_void=0, trials_achieved=30, trials_all=40,
    n_steps=900, graph_cases=None, graph_wrong=None,
)  # fmt: skip


def test_a_row_tells_the_share_of_the_test_epochs_that_were_achieved():
    (row,) = success_results([ROW], GOALS)
    assert (row.name, row.value, row.ok) == ("success_blue", 0.95, True)
    assert row.details == {"achieved": "19 of 20", "void": "0", "rules of epoch": "149"}


def test_a_test_epoch_that_was_cut_short_failed():
    (row,) = success_results([msgspec.structs.replace(ROW, n_void=2)], GOALS)
    assert (row.value, row.ok) == (19 / 22, False)
    assert row.details["achieved"] == "19 of 22"


@pytest.mark.parametrize(("n_successes", "n_tests"), [(18, 20), (0, 1), (0, 0)])
def test_less_than_asked_or_nothing_at_all_is_not_ok(n_successes, n_tests):
    (row,) = success_results([msgspec.structs.replace(ROW, n_successes=n_successes, n_tests=n_tests)], GOALS)
    assert not row.ok


def test_a_folder_without_a_run_is_refused_before_anything_is_measured(tmp_path):
    with pytest.raises(typer.BadParameter, match="run folder"):
        success_rows(tmp_path, rig=tmp_path / "rig.yaml", n_tests=1)
