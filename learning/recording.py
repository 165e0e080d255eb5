"""Where a run's session is recorded, and what of the learner goes in beside what the station tells. The edge."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from config.resolved import Resolved
from learning.checkpoint import encode
from learning.run_folder import SESSION_SUFFIX, RunFolder
from robot.recording.messages import Purpose
from robot.recording.recording import STATE, UNNAMED, Recording

__all__ = ["RecordWanted", "open_recording"]


class RecordWanted(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked for on the command line."""

    path: Path | None = None
    """None is a file of the run's folder."""
    person: str = UNNAMED
    tell: Callable[[str], object] = lambda _: None
    """Is told in words when something is lost."""

    @classmethod
    def of(
        cls, path: Path | None, *, is_asked: bool, person: str, tell: Callable[[str], object]
    ) -> "RecordWanted | None":
        """Return what is wanted, None where nothing is."""
        return cls(path=path, person=person, tell=tell) if is_asked or path is not None else None


def open_recording(
    wanted: RecordWanted,
    folder: RunFolder,
    resolved: Resolved,
    *,
    seed: int,
    state: dict[str, Any] | None,
    purpose: Purpose = Purpose.LEARN,
) -> Recording:
    """Return a recording that has begun.

    Args:
        wanted: what was asked for.
        folder: the run's, where no file is named.
        resolved: what the run is made of.
        seed: its root seed.
        state: the checkpoint that it goes on from; goes into the file, so that it can be replayed alone.
        purpose: what its epochs are for.
    """
    n_done = 0 if state is None else state["n_done"]
    return Recording(
        wanted.path or _free(folder.path, n_done, purpose),
        resolved,
        purpose=purpose,
        seed=seed,
        person=wanted.person,
        about={"learner": resolved.learning.name, "n_done": str(n_done)},
        attached={} if state is None else {STATE: encode(state["agent"])},
        tell=wanted.tell,
    )


def _free(folder: Path, n_done: int, purpose: Purpose) -> Path:
    """Return a name that no file has: what was recorded before a crash is kept beside."""
    stem, n = f"{'session' if purpose is Purpose.LEARN else purpose.value}-{n_done:08d}", 1
    path = folder / f"{stem}{SESSION_SUFFIX}"
    while path.exists():
        n += 1
        path = folder / f"{stem}-{n}{SESSION_SUFFIX}"
    return path
