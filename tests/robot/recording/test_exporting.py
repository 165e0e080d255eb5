"""Sessions as data sets of others: every number is the session's own, and who the sets are for can read them."""

import json
import sys
from pathlib import Path

import minari
import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from robot.bus.topics import PERCEPT, SENT
from robot.cli import app
from robot.messages import ArmCommand, Executed, GripCommand
from robot.recording.errors import UnfitError
from robot.recording.exporting import courses_of
from robot.recording.exporting.episodes import _Open, _take
from robot.recording.exporting.lerobot import ROWS_A_FILE, export_lerobot
from robot.recording.exporting.minari_set import export_minari
from robot.recording.messages import Purpose, ResetMark, StepMark
from robot.recording.session_file import SessionFile
from robot.recording.topics import RESET_MARK, STEP
from tests.support.stations import arm_state, percept

SHIPPED = Path(__file__).parents[2] / "replay"
LEARNT, SHOWN = SHIPPED / "learnt.mcap", SHIPPED / "shown.mcap"
FLOAT = "float"
COLUMNS = {
    "observation.state": "fixed_size_list<element: float>[7]",
    "observation.environment_state": "fixed_size_list<element: float>[12]",
    "observation.known": "fixed_size_list<element: bool>[12]",
    "observation.stamp_ns": "int64",
    "action": "fixed_size_list<element: float>[7]",
    "is_void": "bool",
    "next.done": "bool",
    "next.success": "bool",
    "timestamp": FLOAT,
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
KINDS = {"float32": "float", "int64": "int64", "bool": "bool"}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set") / "autotelic"
    told = export_lerobot(courses_of([LEARNT, LEARNT]), folder)
    return folder, told


def rows(path):
    return pq.read_table(path).to_pylist()


def test_the_files_are_those_of_the_format(exported):
    folder, told = exported
    assert sorted(str(path.relative_to(folder)) for path in folder.rglob("*.*")) == [
        "data/chunk-000/file-000.parquet",
        "meta/episodes/chunk-000/file-000.parquet",
        "meta/info.json",
        "meta/stats.json",
        "meta/tasks.parquet",
    ]
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["codebase_version"], info["robot_type"], info["fps"]) == ("v3.0", "ur5e", 20)
    assert info["splits"] == {"train": f"0:{info['total_episodes']}"}
    assert told == f"{info['total_episodes']} episodes, {info['total_frames']} frames at 20 a second, 4 tasks"


def test_every_feature_is_a_column_of_its_type_and_length(exported):
    folder, _ = exported
    schema = pq.read_schema(folder / "data/chunk-000/file-000.parquet")
    assert {field.name: str(field.type) for field in schema} == COLUMNS
    features = json.loads((folder / "meta/info.json").read_text())["features"]
    assert list(features) == schema.names
    for name, feature in features.items():
        length = feature["shape"][0]
        kind = KINDS[feature["dtype"]]
        assert COLUMNS[name] == (kind if length == 1 else f"fixed_size_list<element: {kind}>[{length}]")
        assert feature["names"] is None or len(feature["names"]) == length


def test_episodes_tile_the_frames_and_tell_where_they_lie(exported):
    folder, _ = exported
    frames, episodes = (
        rows(folder / "data/chunk-000/file-000.parquet"),
        rows(folder / "meta/episodes/chunk-000/file-000.parquet"),
    )
    assert [frame["index"] for frame in frames] == list(range(len(frames)))
    end = 0
    for k, episode in enumerate(episodes):
        assert (episode["episode_index"], episode["dataset_from_index"]) == (k, end)
        end = episode["dataset_to_index"]
        own = frames[episode["dataset_from_index"] : end]
        assert len(own) == episode["length"]
        assert {frame["episode_index"] for frame in own} == {k}
        assert [frame["frame_index"] for frame in own] == list(range(len(own)))
        assert [frame["next.done"] for frame in own] == [False] * (len(own) - 1) + [True]
        assert np.allclose([frame["timestamp"] for frame in own], np.arange(len(own)) / 20, atol=1e-6)
    assert end == len(frames)


def test_tasks_are_the_sub_goals_by_name_and_read_as_an_index(exported):
    folder, _ = exported
    table = pq.read_table(folder / "meta/tasks.parquet")
    names = {row["task_index"]: row["task"] for row in table.to_pylist()}
    assert set(names.values()) == {"orange_pressed", "green_pressed", "blue_pressed", "blue_in_square_box"}
    assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    frames = rows(folder / "data/chunk-000/file-000.parquet")
    for episode in rows(folder / "meta/episodes/chunk-000/file-000.parquet"):
        own = frames[episode["dataset_from_index"] : episode["dataset_to_index"]]
        assert {names[frame["task_index"]] for frame in own} == set(episode["tasks"])


@pytest.mark.parametrize("session", [LEARNT, SHOWN])
def test_what_is_observed_and_done_is_what_was_recorded(tmp_path, session):
    export_lerobot(courses_of([session]), tmp_path / "set")
    frames = rows(tmp_path / "set/data/chunk-000/file-000.parquet")
    seen, sent, steps = {}, [], []
    with SessionFile(session) as opened:
        for topic, _, message in opened.messages(PERCEPT, SENT, STEP, RESET_MARK):
            if topic is PERCEPT:
                seen[message.stamp_ns] = message
            elif topic is SENT:
                sent.append(message)
            elif topic is STEP:
                steps.append((max(seen), [c for c in sent if c.stamp_ns < max(seen)][-1]))
    assert len(frames) == len(steps)
    for frame, (after_ns, command) in zip(frames, steps, strict=True):
        before = seen[frame["observation.stamp_ns"]]
        assert frame["observation.stamp_ns"] < after_ns
        expected = np.float32([*before.distances_m, *before.button_states])
        assert np.array_equal(np.float32(frame["observation.environment_state"]), expected)
        assert np.array_equal(np.float32(frame["action"]), np.float32([*command.q_rad, command.grip.opening_m]))


def test_statistics_are_those_of_the_columns(exported):
    folder, _ = exported
    frames = rows(folder / "data/chunk-000/file-000.parquet")
    stats = json.loads((folder / "meta/stats.json").read_text())
    assert set(stats) == set(COLUMNS)
    for name, told in stats.items():
        column = np.array([frame[name] for frame in frames], dtype=np.float64).reshape(len(frames), -1)
        assert told["count"] == [len(frames)]
        assert np.allclose(told["mean"], column.mean(axis=0))
        assert np.array_equal(told["max"], column.max(axis=0))
        assert np.allclose(told["q50"], np.median(column, axis=0))


def test_minari_loads_what_was_exported_for_it(tmp_path, monkeypatch):
    courses = courses_of([LEARNT])
    told = export_minari(courses, tmp_path)
    assert told == "autotelic/paper-v0: 2 episodes, 48 steps"
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    loaded = minari.load_dataset("autotelic/paper-v0")
    assert loaded.total_steps == 48
    episodes = [episode for course in courses for episode in course.episodes]
    for ours, theirs in zip(episodes, loaded.iterate_episodes(), strict=True):
        assert np.array_equal(theirs.observations["percept"], ours.percepts)
        assert np.array_equal(theirs.observations["state"], ours.joints)
        assert np.array_equal(theirs.actions, ours.actions)
        assert (theirs.terminations | theirs.truncations).tolist() == [False] * (len(ours) - 1) + [True]
        assert np.array_equal(theirs.infos["stamp_ns"][:, 0], ours.stamps_ns)
    with pytest.raises(UnfitError, match="there is one"):
        export_minari(courses, tmp_path)


def step(sent, *, is_void=False):
    executed = Executed(duration_s=0.05, moved_m=(0.0, 0.0, 0.0), target_m=(0.4, 0.0, 0.2), sent=sent)
    return StepMark(executed=executed, verdicts=(), is_void=is_void)


def command(opening_m):
    grip = GripCommand(opening_m=opening_m, force_n=20.0, speed_m_s=0.05)
    return ArmCommand(stamp_ns=0, sequence=0, q_rad=(0.0,) * 6, grip=grip, digital_out=0)


def test_a_step_that_sent_nothing_is_no_frame_and_the_next_begins_with_what_was_seen_last():
    epoch, state = _Open(mark=ResetMark(seed=1, epoch=0, purpose=Purpose.LEARN)), arm_state((0.0,) * 6)
    seen = [percept({}, tcp_m=(0.4, 0.0, 0.2)) for _ in range(4)]
    for message in (seen[0], seen[1], step(command(0.01)), seen[2], step(None), seen[3], step(command(0.02))):
        _take(epoch, message, state)
    assert [c.grip.opening_m for c in epoch.sent] == [0.01, 0.02]
    assert [any(p is other for other in epoch.percepts) for p in seen] == [True, False, True, True]
    assert len(epoch.percepts) == len(epoch.states) == 3


def test_a_step_without_a_percept_is_no_frame():
    epoch, state = _Open(mark=ResetMark(seed=1, epoch=0, purpose=Purpose.LEARN)), arm_state((0.0,) * 6)
    for message in (percept({}, tcp_m=(0.4, 0.0, 0.2)), step(command(0.01))):
        _take(epoch, message, state)
    assert epoch.sent == []


def test_files_end_with_an_episode_before_they_grow_too_long(tmp_path, monkeypatch):
    assert ROWS_A_FILE > 1000
    monkeypatch.setattr("robot.recording.exporting.lerobot.ROWS_A_FILE", 30)
    export_lerobot(courses_of([LEARNT]), tmp_path / "set")
    episodes = rows(tmp_path / "set/meta/episodes/chunk-000/file-000.parquet")
    assert [episode["data/file_index"] for episode in episodes] == [0, 1]
    for episode in episodes:
        own = rows(tmp_path / f"set/data/chunk-000/file-00{episode['data/file_index']}.parquet")
        assert [frame["index"] for frame in own] == list(
            range(episode["dataset_from_index"], episode["dataset_to_index"])
        )


def test_nothing_is_overwritten_and_what_cannot_be_exported_is_said(tmp_path):
    (tmp_path / "set").mkdir()
    (tmp_path / "set/kept.txt").write_text("mine")
    run = CliRunner().invoke
    for arguments, words in (
        ([str(LEARNT), "-o", str(tmp_path / "set")], "expected a new or an empty folder"),
        ([str(tmp_path / "none.mcap"), "-o", str(tmp_path / "new")], "expected a session's file"),
    ):
        done = run(app, ["session", "export", *arguments])
        assert (done.exit_code, words in done.stderr) == (2, True), done.stderr
    assert run(app, ["session", "export", str(LEARNT), "--to", "rlds", "-o", str(tmp_path / "new")]).exit_code == 2
    assert [path.name for path in (tmp_path / "set").iterdir()] == ["kept.txt"]
    assert not (tmp_path / "new").exists()


def test_without_its_libraries_it_says_what_brings_them(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "robot.recording.exporting.lerobot", None)
    done = CliRunner().invoke(app, ["session", "export", str(LEARNT), "-o", str(tmp_path / "new")])
    assert (done.exit_code, "pip install autotelic[export]" in done.stderr) == (2, True), done.stderr


def test_sessions_of_other_time_steps_are_data_sets_of_their_own():
    with pytest.raises(UnfitError, match=r"shown\.mcap: expected the columns of .*learnt\.mcap"):
        courses_of([LEARNT, SHOWN])
    (driven,) = courses_of([SHOWN])
    assert (driven.names.fps, {task for episode in driven.episodes for task in episode.tasks}) == (50, {"drive"})
