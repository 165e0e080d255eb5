import pytest

from learning.abstract import bench
from learning.abstract.bench import bench_abstract


@pytest.fixture
def brief(monkeypatch):
    for name, value in {
        "FEW": 1, "ERA_EPOCHS": 30, "N_SWITCHES": 1, "N_EPOCHS": 30, "SETTLED_EPOCHS": 20, "STEADY_EPOCHS": 20,
        "DECISION_EPOCHS": 3, "ADDED_AT": 20, "ADDED_FOR": 20, "DECISION_GOALS": (3, 4), "N_MANY_GOALS": 6,
    }.items():  # fmt: skip
        monkeypatch.setattr(bench, name, value)


def test_the_bench_tells_every_row_and_judges_what_is_asked(brief):
    rows = {row.name: row for row in bench_abstract(full=False).results}
    beside = {name.removeprefix("oracle_") for name in rows if name.startswith("oracle_")}
    assert beside == {
        "learnt_share", "recovered_share", "learnt_after", "recovered_after", "graph_right_share", "over_optimum_worst",
        "least_success", "twelve_goals_mastered_share", "twelve_goals_mastered_after",
    }  # fmt: skip
    assert beside <= set(rows)
    assert len(rows) == 15 + len(beside)
    asked = {name for name, row in rows.items() if row.goal}
    assert asked == {
        "learnt_share", "recovered_share", "twelve_goals_mastered_share", "false_alarms", "epochs_2000_s",
        "decision_4_goals_ms", "added_goal_old_goals_least",
    }  # fmt: skip
    assert rows["learnt_share"].details == {"runs": f"{rows['learnt_share'].value:.0f} of 1"}
