"""A data set in Minari's own form, made and kept by its library. The edge: files.

The reward is 1 at the last step of an epoch whose goal came about, else 0. An epoch that a person drove, or of which
nobody said a goal, ends without one.
"""

import os
import re
import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

import gymnasium
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer

from robot.recording.errors import UnfitError
from robot.recording.exporting.episodes import Course, Episode, Names

__all__ = ["export_minari"]

ROOT = "MINARI_DATASETS_PATH"
"""Where Minari keeps its data sets, by an environment variable."""


def export_minari(courses: Sequence[Course], folder: Path) -> str:
    """Write sessions as one data set into a folder of such, and return in words what it holds and its name.

    Args:
        courses: of the same columns.
        folder: of Minari's data sets, as MINARI_DATASETS_PATH names it.

    Raises:
        UnfitError: there is such a data set already, or it cannot be written.
    """
    names = courses[0].names
    episodes = [episode for course in courses for episode in course.episodes]
    scenarios = "-".join(sorted({re.sub(r"[^A-Za-z0-9]+", "-", course.scenario) for course in courses}))
    identity = f"autotelic/{scenarios}-v0"
    if (folder / identity).exists():
        raise UnfitError(f"{folder / identity}: expected no data set of that name, there is one")
    try:
        with _kept_in(folder), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that no environment is told of: it was recorded off an arm
            minari.create_dataset_from_buffers(
                identity,
                [_buffer(k, episode) for k, episode in enumerate(episodes)],
                observation_space=_observed(names),
                action_space=_box(len(names.joints) + 1),
                description=f"{names.robot} at {names.fps} time steps a second: {', '.join(names.percept)}",
                data_format="arrow",
            )
    except OSError as error:
        raise UnfitError(f"{folder}: expected to write there, {(error.strerror or str(error)).lower()}") from error
    return f"{identity}: {len(episodes)} episodes, {sum(map(len, episodes))} steps"


def _observed(names: Names) -> gymnasium.spaces.Dict:
    return gymnasium.spaces.Dict({"percept": _box(len(names.percept)), "state": _box(len(names.joints) + 1)})


def _box(n: int) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-np.inf, np.inf, (n,), np.float32)


def _buffer(number: int, episode: Episode) -> EpisodeBuffer:
    n = len(episode)
    is_last = np.arange(n) == n - 1
    has_goal = episode.is_achieved is not None
    return EpisodeBuffer(
        id=number,
        observations={"percept": episode.percepts, "state": episode.joints},
        actions=list(episode.actions),
        rewards=(is_last & (episode.is_achieved is True)).astype(np.float64),
        terminations=is_last & (episode.is_achieved is True),
        truncations=is_last & (not has_goal or episode.is_achieved is False),
        infos={
            "stamp_ns": episode.stamps_ns[:, None],
            "known": episode.known,
            "is_void": np.concatenate(([False], episode.void))[:, None],
        },
    )


@contextmanager
def _kept_in(folder: Path) -> Generator[None]:
    """Have Minari keep its data sets in a folder meanwhile."""
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ[ROOT]
        else:
            os.environ[ROOT] = before
