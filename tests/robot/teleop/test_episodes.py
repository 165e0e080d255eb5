"""A driver keeps episodes, does them again or throws them away, and what is learnt from is what was kept."""

import pytest
import yaml
from typer.testing import CliRunner

from learning.offline import _epochs_of
from robot.cli import app
from robot.recording.checking import check
from robot.recording.exporting import courses_of
from robot.recording.messages import EpisodeEnd
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPISODE, RESET_MARK
from robot.teleop.device import EpisodeKey
from robot.teleop.episodes import Episodes
from robot.teleop.keys import KeyBoard, KeyEvent, Kind

NEXT, REDO, DISCARD = EpisodeKey
S = 1_000_000_000


class Marks:
    def __init__(self):
        self.made = []

    def mark(self, mark):
        self.made.append((mark.number, mark.table, mark.end))


class Table:
    """A station that is told what to lay out."""

    def __init__(self):
        self.laid_out = []

    def reset(self, *, seed, epoch):
        self.laid_out.append((seed, epoch))


def driven(keys, *, lays_out=True):
    table, marks = Table(), Marks()
    episodes = Episodes(table, marks=marks, seed=7, lays_out=lays_out)
    episodes.begin()
    for key in keys:
        episodes.end(key)
    episodes.quit()
    episodes.quit()
    return table.laid_out, marks.made, episodes.n_kept


@pytest.mark.parametrize(
    ("keys", "tables", "ends"),
    [
        ([], [0], [EpisodeEnd.KEPT]),
        ([NEXT], [0, 1], [EpisodeEnd.KEPT, EpisodeEnd.KEPT]),
        ([REDO], [0, 0], [EpisodeEnd.REDONE, EpisodeEnd.KEPT]),
        ([DISCARD, REDO], [0, 1, 1], [EpisodeEnd.DISCARDED, EpisodeEnd.REDONE, EpisodeEnd.KEPT]),
    ],
)
def test_each_episode_has_its_table_and_its_end(keys, tables, ends):
    laid_out, made, n_kept = driven(keys)
    assert laid_out == [(7, table) for table in tables]
    assert [end for _, _, end in made[1::2]] == ends
    assert [end for _, _, end in made[::2]] == [None] * len(tables)
    assert [number for number, _, _ in made] == [n // 2 for n in range(2 * len(tables))]
    assert n_kept == ends.count(EpisodeEnd.KEPT)


def test_where_a_person_lays_the_table_out_only_marks_are_made():
    laid_out, made, _ = driven([NEXT], lays_out=False)
    assert laid_out == []
    assert len(made) == 4


@pytest.mark.parametrize(("is_armed", "n_marks"), [(True, 3), (False, 2)])
def test_an_episode_that_latched_is_not_kept(is_armed, n_marks):
    table, marks = Table(), Marks()
    episodes = Episodes(table, marks=marks, seed=7, lays_out=True)
    episodes.begin()
    assert episodes.void(lambda: is_armed) is is_armed
    assert marks.made[1] == (0, 0, EpisodeEnd.DISCARDED)
    assert len(marks.made) == n_marks
    episodes.quit()
    assert episodes.n_kept == (1 if is_armed else 0)


@pytest.mark.parametrize(("key", "said"), [("n", NEXT), ("b", REDO), ("backspace", DISCARD)])
def test_a_key_says_it_once_and_lets_go_of_what_moves(key, said):
    board = KeyBoard(now_ns=lambda: S)
    board.feed(KeyEvent("w"))
    board.feed(KeyEvent(key))
    first, second = board.asked(), board.asked()
    assert (first.episode, first.is_held) == (said, False)
    assert second.episode is None
    board.feed(KeyEvent(key, Kind.REPEAT))
    assert board.asked().episode is None, "held down it says nothing more"


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Drive three episodes by a script: one is kept, one done again, the last one kept by the end."""
    folder = tmp_path_factory.mktemp("driven")
    steps = [
        {"for_s": 0.4, "linear": [0, 1, 0]},
        {"for_s": 0.4, "linear": [0, 0, -0.5], "episode": "next"},
        {"for_s": 0.4, "linear": [0, -1, 0], "episode": "redo"},
    ]
    (folder / "script.yaml").write_text(yaml.safe_dump({"steps": steps}))
    asked = ["teleop", "--rig", "twin", "--device", f"script:{folder / 'script.yaml'}", "--no-view", "--fast"]
    done = CliRunner().invoke(app, [*asked, "--record-to", str(folder / "drive.mcap")])
    assert done.exit_code == 0, done.output
    return folder / "drive.mcap"


def test_a_recorded_drive_says_where_its_episodes_begin_and_end(session):
    with SessionFile(session) as opened:
        marks = [(mark.number, mark.table, mark.end) for _, _, mark in opened.messages(EPISODE)]
        tables = [mark.epoch for _, _, mark in opened.messages(RESET_MARK)]
        assert check(opened).is_sound
    assert tables == [0, 1, 1]
    assert [end for _, _, end in marks] == [None, EpisodeEnd.KEPT, None, EpisodeEnd.REDONE, None, EpisodeEnd.KEPT]


def test_what_was_not_kept_is_neither_learnt_from_nor_exported(session):
    (course,) = courses_of([session])
    assert [episode.epoch for episode in course.episodes] == [0, 1]
    with SessionFile(session) as opened:
        epochs = list(_epochs_of(opened))
    assert len(epochs) == 2
    assert [len(percepts) for percepts in epochs] == [len(episode) + 1 for episode in course.episodes]
