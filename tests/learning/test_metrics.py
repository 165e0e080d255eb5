"""What a run's figures mean, by hand-worked cases."""

import msgspec
import pytest

from learning.errors import RunFolderError
from learning.interfaces import TrialOutcome
from learning.metrics import (
    AddedGoal,
    Era,
    due_evaluations,
    due_graph_looks,
    eras,
    first_running,
    graph_errors,
    is_mastered,
    optimal_trials,
    reachable_states,
    summarise,
)
from learning.rows import EvaluationRow, GoalRow, GraphRow, TrialRow, cells, header, read_rows
from learning.tables import TABLES, Tables


def before(goal, state):
    """The paper's rules before the change."""
    return (True, True, True, state[1], state[2], state[4])[goal]


def after(goal, state):
    """The paper's rules after the change."""
    return (True, True, True, not state[1], not state[2], state[4] and state[0])[goal]


def row(epoch, goal=0, *, rules_epoch=None, hits=20, tests=20, trials=1, wrong=0):
    return EvaluationRow(
        epoch=epoch,
        rules_epoch=epoch - 1 if rules_epoch is None else rules_epoch,
        goal=goal,
        n_tests=tests,
        n_successes=hits,
        n_void=0,
        trials_achieved=hits * trials,
        trials_all=hits * trials + (tests - hits) * 8,
        n_steps=100,
        graph_cases=4,
        graph_wrong=wrong,
    )


def look(epoch, wrong=0, *, rules_epoch=None):
    return GraphRow(
        epoch=epoch, rules_epoch=epoch - 1 if rules_epoch is None else rules_epoch, n_cases=8, n_wrong=wrong
    )


def choice(epoch, goal=0, steps=10):
    return GoalRow(epoch=epoch, goal=goal, is_achieved=1, is_void=0, n_trials=2, n_steps=steps)


def test_the_papers_optimal_trials_follow_from_its_rules():
    assert optimal_trials(before, 6) == (1, 1, 1, 2, 2, 3)
    assert optimal_trials(after, 6) == (1, 1, 1, 1, 1, 3)


def test_a_goal_that_nothing_allows_has_no_optimum():
    assert optimal_trials(lambda goal, state: goal == 0, 2) == (1, None)


def test_only_states_that_the_rules_let_come_about_are_reachable():
    # Red and blue grabbed need their buttons: of 64 states those with 3 and not 1, 4 and not 2, 5 and not 4 are out.
    states = reachable_states(before, 6)
    assert len(states) == len(set(states)) == 2 * 3 * 4
    assert all(state[1] or not state[3] for state in states)
    assert states[0] == (False,) * 6


def test_no_more_states_are_looked_at_than_the_limit():
    assert len(reachable_states(lambda goal, state: True, 10, limit=100)) == 100


def test_graph_errors_count_states_predicted_wrongly():
    states = reachable_states(after, 6)
    assert graph_errors(after, after, states, 6) == [0] * 6
    errors = graph_errors(before, after, states, 6)
    assert errors[:3] == [0, 0, 0]
    # Goal 3: before it needs 1, after it needs not 1: wrong everywhere.
    assert errors[3] == len(states)
    assert 0 < errors[5] < len(states)


def test_evaluations_are_due_every_so_often_densely_after_changes_and_twice_at_a_change():
    protocol = {"every": 50, "dense_every": 10, "dense_for": 30, "changes": [100], "n_epochs": 205}
    due = {n: rules for n in range(206) if (rules := due_evaluations(n, **protocol))}
    assert due == {
        10: [9], 20: [19], 30: [29], 50: [49], 100: [99, 100], 110: [109], 120: [119], 130: [129], 150: [149],
        200: [199], 205: [204],
    }  # fmt: skip


def test_eras_lie_between_changes():
    assert eras([1000], 2000) == [Era(from_epoch=0, until_epoch=1000), Era(from_epoch=1000, until_epoch=2000)]
    assert eras([1000], 700) == [Era(from_epoch=0, until_epoch=700)]
    assert eras([], 5) == [Era(from_epoch=0, until_epoch=5)]


@pytest.mark.parametrize(("hits", "tests", "mastered"), [(18, 20, True), (17, 20, False), (9, 10, True), (0, 0, False)])
def test_mastered_is_eighteen_of_twenty(hits, tests, mastered):
    assert is_mastered(row(10, hits=hits, tests=tests)) is mastered


def test_a_goal_that_became_known_is_judged_from_then_on_and_so_are_the_others_meanwhile():
    evaluations = [
        row(50, 0, hits=2), row(100, 0), row(110, 0, hits=19), row(110, 1, hits=4), row(120, 0), row(120, 1),
        row(130, 0, hits=16), row(130, 1, hits=18), row(210, 0, hits=0, rules_epoch=209), row(210, 1, hits=0),
    ]  # fmt: skip
    goals = [choice(epoch) for epoch in range(220)]
    told = summarise(
        goals, evaluations, [], n_goals=2, n_trials=8, changes=[200], optima=[(1, 1), (1, 1)], from_epochs=[0, 100]
    )
    assert told.added == (AddedGoal(goal=1, from_epoch=100, mastered_after=20, others_least_success=16 / 20),)
    early = summarise(
        goals[:90], evaluations[:1], [], n_goals=2, n_trials=8, changes=[200], optima=[(1, 1)], from_epochs=[0, 100]
    )
    assert early.added == ()


def test_after_a_goal_became_known_it_is_evaluated_as_densely_as_after_a_change():
    how = {"every": 50, "dense_every": 10, "dense_for": 20, "changes": [], "n_epochs": 200}
    due = [n for n in range(1, 201) if due_evaluations(n, **how, arrivals=[75])]
    assert due == [10, 20, 50, 85, 95, 100, 150, 200]


def test_an_epoch_cut_short_counts_against_mastery():
    three_void = msgspec.structs.replace(row(10, hits=18, tests=18), n_void=3)
    assert not is_mastered(three_void)
    assert is_mastered(msgspec.structs.replace(three_void, n_void=2))


def test_learnt_is_the_first_of_two_evaluations_running():
    marks = [(10, True), (20, False), (30, True), (40, True), (50, True)]
    assert first_running(marks, running=2) == 30
    assert first_running(marks, running=1) == 10
    assert first_running(marks, running=4) is None
    assert first_running([], running=1) is None


def test_the_graph_is_looked_at_every_so_often_and_under_both_rules_at_a_change():
    due = {n: rules for n in range(36) if (rules := due_graph_looks(n, every=10, changes=[15], n_epochs=35))}
    assert due == {10: [9], 15: [14, 15], 20: [19], 30: [29], 35: [34]}


def test_a_summary_worked_by_hand():
    evaluations = [
        row(50, 0), row(50, 1, hits=17),
        row(100, 0), row(100, 1, trials=3, wrong=2),
        row(100, 0, rules_epoch=100, hits=0, wrong=1), row(100, 1, rules_epoch=100),
        row(150, 0), row(150, 1, trials=2),
        row(200, 0, hits=18), row(200, 1, trials=3),
    ]  # fmt: skip
    goals = [choice(epoch, goal=epoch % 2) for epoch in range(200)]
    graphs = [look(40, 3), look(50), look(60, 1), look(100), look(100, 4, rules_epoch=100), look(130), look(140)]
    summary = summarise(goals, evaluations, graphs, n_goals=2, n_trials=8, changes=[100], optima=[(1, 2), (1, 2)])
    first, second = summary.eras
    assert (summary.n_epochs, summary.n_trials, summary.n_time_steps) == (200, 400, 2000)
    assert summary.choices_by_goal == (100, 100)
    assert summary.time_steps_to_all is None
    assert (first.learnt_after, first.graph_right_after) == (None, 50)
    assert (second.learnt_after, second.graph_right_after) == (50, 30)
    assert (first.graph_wrong_later, second.graph_wrong_later) == (0.5, 0.0)
    assert second.success_by_goal == (38 / 40, 1.0)
    assert second.trials_by_goal == (1.0, 2.5)
    assert second.trials_over_optimum_of_successes == pytest.approx((0.0 + 0.5) / 2)
    # Goal 0: 38 tests of one trial, two failures of eight.
    assert second.trials_over_optimum == pytest.approx(((38 + 16) / 40 - 1 + 0.5) / 2)
    assert second.trials_over_optimum_worst == pytest.approx(0.5)
    assert (first.graph_wrong_last, second.graph_wrong_last) == ((0, 8), (0, 8))


def test_an_epoch_cut_short_counts_as_one_that_failed():
    evaluations = [msgspec.structs.replace(row(100), n_void=5)]
    goals = [choice(epoch) for epoch in range(100)]
    summary = summarise(goals, evaluations, [], n_goals=1, n_trials=8, changes=[], optima=[(1,)])
    assert summary.eras[0].success_by_goal == (20 / 25,)
    assert summary.eras[0].trials_over_optimum == pytest.approx((20 + 40) / 25 - 1)
    assert summary.eras[0].trials_over_optimum_of_successes == 0.0


def test_time_steps_to_all_are_those_before_everything_was_learnt():
    evaluations = [row(50), row(100), row(150)]
    goals = [choice(epoch, steps=epoch) for epoch in range(150)]
    summary = summarise(goals, evaluations, [], n_goals=1, n_trials=8, changes=[], optima=[(1,)])
    assert summary.eras[0].learnt_after == 50
    assert summary.time_steps_to_all == sum(range(50))


def test_only_the_last_two_hundred_epochs_of_an_era_count_as_settled():
    evaluations = [row(800, hits=0), row(801, trials=1), row(1000, trials=1)]
    goals = [choice(epoch) for epoch in range(1000)]
    summary = summarise(goals, evaluations, [], n_goals=1, n_trials=8, changes=[], optima=[(1,)])
    assert summary.eras[0].success_by_goal == (1.0,)


def trial_row(epoch=0, predicted=0.1):
    return TrialRow(
        epoch=epoch, trial=1, goal=0, subgoal=1, state="00", state_after="01", outcome=TrialOutcome.BLOCKED, n_steps=3,
        predicted=predicted, skill=1 / 3, temperature=0.01,
    )  # fmt: skip


def test_rows_read_back_as_they_were_written(tmp_path):
    rows = [trial_row(predicted=value) for value in (0.1 + 0.2, 5e-324, 1.0)]
    evaluations = [row(10), EvaluationRow(**{**asdict(row(20)), "graph_cases": None, "graph_wrong": None})]
    with Tables(tmp_path) as tables:
        tables.append("trials", rows)
        tables.append("evaluations", evaluations)
    assert read_rows(tmp_path / "trials.csv", TrialRow) == rows
    assert read_rows(tmp_path / "evaluations.csv", EvaluationRow) == evaluations
    assert read_rows(tmp_path / "goals.csv", GoalRow) == []


def test_a_torn_last_line_is_left_out(tmp_path):
    path = tmp_path / "goals.csv"
    lines = [header(GoalRow), cells(choice(0)), cells(choice(1))]
    path.write_text("\n".join(lines)[:-3])
    assert read_rows(path, GoalRow) == [choice(0)]


@pytest.mark.parametrize(
    "text", ["", "epoch,other\n1,2\n", "epoch,goal,is_achieved,is_void,n_trials,n_steps\n1,2,x,0,1,1\n"]
)
def test_what_is_no_such_table_is_refused(tmp_path, text):
    path = tmp_path / "goals.csv"
    path.write_text(text)
    with pytest.raises(RunFolderError, match=r"goals\.csv"):
        read_rows(path, GoalRow)
    with pytest.raises(RunFolderError, match="absent"):
        read_rows(tmp_path / "absent.csv", GoalRow)


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (b"\xff", "line 3: expected UTF-8 text, got b'\\xff'"),
        (b"\0", "line 3: expected 6 cells of text, got '1,0"),
        (b"9" * 200_000, "line 3: "),
        (b"\x85,7".decode("latin-1").encode(), "line 3: expected 6 cells of text"),
        (b"x", "line 3: Expected `int`, got `str`"),
    ],
)
def test_a_damaged_line_is_told_by_file_and_number(tmp_path, damage, told):
    path = tmp_path / "goals.csv"
    lines = [line.encode() for line in (header(GoalRow), cells(choice(0)), cells(choice(1)), cells(choice(2)))]
    lines[2] += damage
    path.write_bytes(b"".join(line + b"\n" for line in lines))
    with pytest.raises(RunFolderError) as raised:
        read_rows(path, GoalRow)
    said = str(raised.value)
    assert said.startswith(f"{path}: {told}")
    assert len(said) < len(str(path)) + 200
    assert len(said.splitlines()) == 1


def test_tables_are_cut_back_to_the_rows_a_checkpoint_knew_and_go_on_from_there(tmp_path):
    with Tables(tmp_path) as tables:
        tables.append("trials", [trial_row(0)])
        n_rows = {name: tables.n_rows(name) for name in TABLES}
        tables.append("trials", [trial_row(1), trial_row(2)])
    whole = (tmp_path / "trials.csv").read_bytes()
    (tmp_path / "trials.csv").write_bytes(whole + b"torn,li")
    with Tables(tmp_path, n_rows=n_rows) as tables:
        tables.append("trials", [trial_row(1), trial_row(2)])
        assert tables.n_rows("trials") == 3
    assert (tmp_path / "trials.csv").read_bytes() == whole


def test_a_table_with_fewer_rows_than_its_checkpoint_knew_is_refused(tmp_path):
    with Tables(tmp_path) as tables:
        tables.append("goals", [choice(0), choice(1)])
    torn = (tmp_path / "goals.csv").read_bytes()[:-1]
    (tmp_path / "goals.csv").write_bytes(torn)
    with pytest.raises(RunFolderError, match=r"goals\.csv: expected the 2 rows .* got 1"):
        Tables(tmp_path, n_rows=dict.fromkeys(TABLES, 0) | {"goals": 2})
    (tmp_path / "goals.csv").unlink()
    with pytest.raises(RunFolderError, match="got 0"):
        Tables(tmp_path, n_rows=dict.fromkeys(TABLES, 0) | {"goals": 2})


def asdict(value):
    return {name: getattr(value, name) for name in value.__struct_fields__}
