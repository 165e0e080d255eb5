"""A data set in LeRobot's format v3.0, as its library reads it: parquet tables and JSON in one folder. The edge: files.

Source: huggingface/lerobot, `src/lerobot/datasets` (utils.py, io_utils.py, dataset_metadata.py) at 7427f3180 of August
2026: folders, file names, columns and statistics. The format makes a frame's time its number over the frames a second;
the measured stamps are a column of their own.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from robot.recording.errors import UnfitError
from robot.recording.exporting.episodes import Course, Episode, Names

__all__ = ["export_lerobot"]

VERSION = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
MOST_FILES, MOST_MB, MOST_VIDEO_MB = 1000, 100, 200
ROWS_A_FILE = 200_000
"""Some 60 MB."""
QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
Column = npt.NDArray[Any]


def export_lerobot(courses: Sequence[Course], folder: Path) -> str:
    """Write sessions as one data set, and return in words what it holds.

    Args:
        courses: of the same columns.
        folder: new, or empty.

    Raises:
        UnfitError: there is something in the folder, or it cannot be written.
    """
    names = courses[0].names
    episodes = [episode for course in courses for episode in course.episodes]
    tasks = sorted({task for episode in episodes for task in episode.tasks})
    numbers = {task: k for k, task in enumerate(tasks)}
    try:
        if folder.exists() and any(folder.iterdir()):
            raise UnfitError(f"{folder}: expected a new or an empty folder, there is something in it")
        rows, columns = _write_data(folder, episodes, numbers, names)
        _write_table(folder / EPISODES.format(chunk_index=0, file_index=0), pa.Table.from_pylist(rows))
        _write_table(folder / "meta/tasks.parquet", _task_table(tasks))
        _write_json(folder / "meta/stats.json", {name: _statistics(values) for name, values in columns.items()})
        n_frames = sum(map(len, episodes))
        _write_json(folder / "meta/info.json", _info(names, len(episodes), n_frames, len(tasks)))
    except OSError as error:
        raise UnfitError(f"{folder}: expected to write there, {(error.strerror or str(error)).lower()}") from error
    return f"{len(episodes)} episodes, {n_frames} frames at {names.fps} a second, {len(tasks)} tasks"


def _write_data(
    folder: Path, episodes: Sequence[Episode], numbers: Mapping[str, int], names: Names
) -> tuple[list[dict[str, object]], dict[str, Column]]:
    """Write the frames, and return a row an episode and all columns whole, for what is told of them."""
    rows: list[dict[str, object]] = []
    whole: dict[str, list[Column]] = {name: [] for name in _features(names)}
    first = 0
    for n_file, group in enumerate(_files(episodes)):
        at = {"chunk_index": n_file // MOST_FILES, "file_index": n_file % MOST_FILES}
        tables = []
        for episode in group:
            index = len(rows)
            columns = _columns(episode, numbers, names, index=index, first=first)
            for name, values in columns.items():
                whole[name].append(values)
            tables.append(_frame_table(columns))
            rows.append(_episode_row(episode, columns, at, index=index, first=first))
            first += len(episode)
        _write_table(folder / DATA.format(**at), pa.concat_tables(tables))
    return rows, {name: np.concatenate(parts) for name, parts in whole.items()}


def _files(episodes: Sequence[Episode]) -> Iterator[list[Episode]]:
    """Yield episodes by the file that they go into; one is never in two."""
    group: list[Episode] = []
    n_rows = 0
    for episode in episodes:
        if group and n_rows + len(episode) > ROWS_A_FILE:
            yield group
            group, n_rows = [], 0
        group.append(episode)
        n_rows += len(episode)
    yield group


def _columns(
    episode: Episode, numbers: Mapping[str, int], names: Names, *, index: int, first: int
) -> dict[str, Column]:
    """Return an episode's columns, one row a time step; the percept after the last step is no frame's."""
    n = len(episode)
    frames = np.arange(n, dtype=np.int64)
    is_last = frames == n - 1
    return {
        "observation.state": episode.joints[:n],
        "observation.environment_state": episode.percepts[:n],
        "observation.known": episode.known[:n],
        "observation.stamp_ns": episode.stamps_ns[:n],
        "action": episode.actions,
        "is_void": episode.void,
        "next.done": is_last,
        "next.success": is_last & (episode.is_achieved is True),
        "timestamp": (frames / names.fps).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(n, index, dtype=np.int64),
        "index": frames + first,
        "task_index": np.array([numbers[task] for task in episode.tasks], dtype=np.int64),
    }


def _features(names: Names) -> dict[str, dict[str, object]]:
    """Return what each column is."""
    joints = [*(f"{joint}.pos" for joint in names.joints), "gripper.pos"]
    percept = list(names.percept)

    def many(dtype: str, of: list[str]) -> dict[str, object]:
        return {"dtype": dtype, "shape": [len(of)], "names": of}

    def one(dtype: str) -> dict[str, object]:
        return {"dtype": dtype, "shape": [1], "names": None}

    return {
        "observation.state": many("float32", joints),
        "observation.environment_state": many("float32", percept),
        "observation.known": many("bool", percept),
        "observation.stamp_ns": one("int64"),
        "action": many("float32", joints),
        "is_void": one("bool"),
        "next.done": one("bool"),
        "next.success": one("bool"),
        "timestamp": one("float32"),
        "frame_index": one("int64"),
        "episode_index": one("int64"),
        "index": one("int64"),
        "task_index": one("int64"),
    }


def _frame_table(columns: Mapping[str, Column]) -> pa.Table:
    arrays = [_array(values) for values in columns.values()]
    return pa.Table.from_arrays(arrays, names=list(columns))


def _array(values: Column) -> pa.Array:
    """Return a column: of one number a frame as it is, of several as lists of that length."""
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.reshape(-1)), values.shape[1])


def _episode_row(
    episode: Episode, columns: Mapping[str, Column], at: Mapping[str, int], *, index: int, first: int
) -> dict[str, object]:
    told = {
        f"stats/{name}/{what}": value for name, values in columns.items() for what, value in _statistics(values).items()
    }
    return {
        "episode_index": index, "tasks": sorted(set(episode.tasks)), "length": len(episode),
        "data/chunk_index": at["chunk_index"], "data/file_index": at["file_index"],
        "dataset_from_index": first, "dataset_to_index": first + len(episode),
        "table_seed": str(episode.seed), "epoch": episode.epoch, "purpose": episode.purpose.value,
        **told,
        "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
    }  # fmt: skip


def _statistics(values: Column) -> dict[str, list[float] | list[int]]:
    """Return what a column comes to, entry by entry."""
    rows = values.reshape(len(values), -1).astype(np.float64)
    quantiles = np.quantile(rows, QUANTILES, axis=0)
    told: dict[str, list[float] | list[int]] = {
        name: reduce(rows, axis=0).tolist() for name, reduce in _REDUCED.items()
    }  # fmt: skip
    told["count"] = [len(rows)]
    return told | {f"q{round(100 * q):02d}": of.tolist() for q, of in zip(QUANTILES, quantiles, strict=True)}


_REDUCED: dict[str, Callable[..., Any]] = {"min": np.min, "max": np.max, "mean": np.mean, "std": np.std}


def _task_table(tasks: Sequence[str]) -> pa.Table:
    """Return the tasks as pandas writes a table whose index they are: so the library reads it."""
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks, pa.string())})
    described = {
        "index_columns": ["task"],
        "column_indexes": [
            {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object", "metadata": None}
        ],
        "columns": [
            {"name": n, "field_name": n, "pandas_type": kind, "numpy_type": dtype, "metadata": None}
            for n, kind, dtype in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
        ],
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(described)})


def _info(names: Names, n_episodes: int, n_frames: int, n_tasks: int) -> dict[str, object]:
    return {
        "codebase_version": VERSION,
        "robot_type": names.robot,
        "total_episodes": n_episodes,
        "total_frames": n_frames,
        "total_tasks": n_tasks,
        "chunks_size": MOST_FILES,
        "data_files_size_in_mb": MOST_MB,
        "video_files_size_in_mb": MOST_VIDEO_MB,
        "fps": names.fps,
        "splits": {"train": f"0:{n_episodes}"},
        "data_path": DATA,
        "video_path": None,
        "features": _features(names),
    }


def _write_table(path: Path, table: pa.Table) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def _write_json(path: Path, told: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
