"""Tables are cut back to what a checkpoint counts on; one that has less, a torn row not counted, is told."""

import pytest

from learning.errors import RunFolderError
from learning.rows import GoalRow, read_rows
from learning.tables import TABLES, Tables


def row(epoch):
    return GoalRow(epoch=epoch, goal=0, is_achieved=1, is_void=0, n_trials=1, n_steps=7)


@pytest.fixture
def folder(tmp_path):
    """Tables with three goal rows."""
    with Tables(tmp_path) as tables:
        tables.append("goals", [row(0), row(1), row(2)])
    return tmp_path


def counts(n_goals):
    return dict.fromkeys(TABLES, 0) | {"goals": n_goals}


@pytest.mark.parametrize("n_kept", [0, 1, 3])
def test_rows_after_the_checkpoints_are_cut_off_and_new_ones_follow(folder, n_kept):
    with Tables(folder, n_rows=counts(n_kept)) as tables:
        tables.append("goals", [row(9)])
        assert tables.n_rows("goals") == n_kept + 1
    assert [entry.epoch for entry in read_rows(folder / "goals.csv", GoalRow)] == [*range(n_kept), 9]


def test_a_torn_last_row_is_cut_off(folder):
    path = folder / "goals.csv"
    path.write_bytes(path.read_bytes() + b"3,0,1")
    with Tables(folder, n_rows=counts(3)) as tables:
        tables.append("goals", [row(3)])
    assert [entry.epoch for entry in read_rows(path, GoalRow)] == [0, 1, 2, 3]


@pytest.mark.parametrize("torn", [b"", b"3,0,1"])
def test_fewer_whole_rows_than_the_checkpoint_counts_on_are_told(folder, torn):
    path = folder / "goals.csv"
    path.write_bytes(path.read_bytes() + torn)
    with pytest.raises(RunFolderError, match=r"goals\.csv: expected the 4 rows that the checkpoint counts on, got 3"):
        Tables(folder, n_rows=counts(4))
    path.unlink()
    with pytest.raises(RunFolderError, match="got 0"):
        Tables(folder, n_rows=counts(4))
