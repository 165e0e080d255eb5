"""A run's folder: what was run, with what, and where its figures lie. One process at a time may write to it."""

import fcntl
import hashlib
from pathlib import Path
from types import TracebackType
from typing import IO, Annotated, Self

import msgspec
from msgspec import Meta

from config.loader import load_resolved
from config.resolved import Resolved
from learning.checkpoint import CheckpointStore, write_atomically
from learning.errors import RunFolderError
from learning.rows import EvaluationRow, GoalRow, GraphRow, TrialRow, read_rows
from learning.stops import Stops
from learning.time_spent import TimeSpent

__all__ = [
    "CONFIG_NAME",
    "FORMAT",
    "MANIFEST_NAME",
    "PROFILE_NAME",
    "SESSION_SUFFIX",
    "STOPS_NAME",
    "TAUGHT_NAME",
    "GoalInfo",
    "Manifest",
    "RunFolder",
]

FORMAT = 1
CONFIG_NAME = "config.yaml"
MANIFEST_NAME = "run.json"
PROFILE_NAME = "profile.json"
STOPS_NAME = "stops.json"
SESSION_SUFFIX = ".mcap"
TAUGHT_NAME = "taught.json"
"""What the learner was shown before it began, and where each piece of it comes from."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]


class GoalInfo(msgspec.Struct, frozen=True, kw_only=True):
    """A goal as figures and tables show it."""

    name: str
    kind: str
    colour: tuple[Share, Share, Share]
    """Of the goal's object."""
    from_epoch: int = 0
    """Epoch from which the learner knows of it."""


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """What a run is made of, beside its config."""

    format: int = FORMAT
    seed: int
    learner: str
    scenario: str
    rig: str
    n_epochs: int
    n_trials: int
    """Trials that an epoch has."""
    changes: tuple[int, ...]
    """Epochs at which the rules change."""
    goals: tuple[GoalInfo, ...]
    optima: tuple[tuple[int | None, ...], ...]
    """Least trials of each goal, for each era between changes."""
    config_sha256: str
    plant: str
    model_sha256: str | None
    """Digest of the plant's model, None where it has none."""
    git: str | None
    versions: dict[str, str]
    machine: dict[str, str | int]

    @property
    def arrivals(self) -> tuple[int, ...]:
        """Epochs at which goals become known, after the first."""
        return tuple(sorted({goal.from_epoch for goal in self.goals} - {0}))


class RunFolder:
    """The folder of one run, for reading; `write` makes it this process's own."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints = CheckpointStore(path / "checkpoints")
        self._lock: IO[str] | None = None
        self._is_made_here = False

    # --------------------------------------------------------------------------------------------------------- read

    def config(self) -> Resolved:
        """Return the resolved config.

        Raises:
            ConfigError: it is missing or was changed into something wrong.
        """
        return load_resolved(self.path / CONFIG_NAME)

    @property
    def figures(self) -> Path:
        """Folder of the figures."""
        return self.path / "figures"

    def holds_run(self) -> bool:
        """Whether a run was started here."""
        return (self.path / MANIFEST_NAME).is_file() and (self.path / CONFIG_NAME).is_file()

    def manifest(self) -> Manifest:
        """Return what was run.

        Raises:
            RunFolderError: this is no run folder, one of another format, or its optima are not of its rules and goals.
        """
        path = self.path / MANIFEST_NAME
        try:
            raw = path.read_bytes()
        except OSError as error:
            message = f"{self.path}: expected a run folder, found no run.json in it ({error.strerror})"
            raise RunFolderError(message) from error
        try:
            manifest = msgspec.json.decode(raw, type=Manifest)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise RunFolderError(_damage(path, raw, error)) from error
        if manifest.format != FORMAT:
            raise RunFolderError(f"{path}: expected format {FORMAT}, got {manifest.format}")
        _refuse_strange_optima(path, manifest)
        return manifest

    def time_spent(self) -> TimeSpent:
        """Return where the time of the sessions so far went; none where that is not known."""
        try:
            return msgspec.json.decode((self.path / PROFILE_NAME).read_bytes(), type=TimeSpent)
        except (OSError, msgspec.DecodeError, UnicodeDecodeError):
            return TimeSpent()

    def stops(self) -> Stops | None:
        """Return what stopped the arm in the sessions so far; None where that is not known."""
        try:
            return msgspec.json.decode((self.path / STOPS_NAME).read_bytes(), type=Stops)
        except (OSError, msgspec.DecodeError, UnicodeDecodeError):
            return None

    def trials(self) -> list[TrialRow]:
        """Return one row a trial."""
        return read_rows(self.path / "trials.csv", TrialRow)

    def goals(self) -> list[GoalRow]:
        """Return one row a goal choice."""
        return read_rows(self.path / "goals.csv", GoalRow)

    def graphs(self) -> list[GraphRow]:
        """Return one row a look at the learnt graph."""
        return read_rows(self.path / "graphs.csv", GraphRow)

    def evaluations(self) -> list[EvaluationRow]:
        """Return one row an evaluation and goal."""
        return read_rows(self.path / "evaluations.csv", EvaluationRow)

    # -------------------------------------------------------------------------------------------------------- write

    def refuse_changed_config(self) -> None:
        """Check that the config is what the run began with: its rows before and after would not be of one run.

        Raises:
            RunFolderError: the file was changed since.
        """
        path = self.path / CONFIG_NAME
        if hashlib.sha256(path.read_bytes()).hexdigest() != self.manifest().config_sha256:
            raise RunFolderError(
                f"{path}: expected the config that the run began with, its digest in {MANIFEST_NAME} is another: undo "
                "the change, or begin a run of its own in another folder by --out"
            )

    def refuse_unless_empty(self) -> None:
        """Check that a run may start here.

        Raises:
            RunFolderError: the folder holds a run already, or something else.
        """
        if self.holds_run():
            raise RunFolderError(
                f"{self.path} holds a run already: go on with it by --resume, or name another folder by --out"
            )
        foreign = sorted(entry.name for entry in self.path.iterdir() if not _is_left_over(entry))
        if foreign:
            raise RunFolderError(f"{self.path}: expected an empty or new folder, found {foreign[0]} in it")

    def start(self, manifest: Manifest, config: str) -> None:
        """Write what is to be run; the config comes last and makes the folder a run's.

        Raises:
            RunFolderError: the folder holds a run already, or something else.
        """
        self.refuse_unless_empty()
        self.write_json(MANIFEST_NAME, manifest)
        write_atomically(self.path / CONFIG_NAME, config.encode())

    def keep_time_spent(self, spent: TimeSpent) -> None:
        """Write where the time of all sessions went."""
        self.write_json(PROFILE_NAME, spent.as_tree())

    def keep_stops(self, stops: Stops) -> None:
        """Write what stopped the arm in all sessions."""
        self.write_json(STOPS_NAME, stops.as_tree())

    def write_json(self, name: str, value: msgspec.Struct | dict[str, object]) -> None:
        """Write one JSON file, indented."""
        write_atomically(self.path / name, msgspec.json.format(msgspec.json.encode(value), indent=2) + b"\n")

    def __enter__(self) -> Self:
        """Take the folder for this process.

        Raises:
            RunFolderError: another process has it, or it cannot be made.
        """
        self._is_made_here = not self.path.exists()
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = (self.path / "lock").open("w")
        except OSError as error:
            message = f"{self.path}: expected a folder that can be written to, {(error.strerror or str(error)).lower()}"
            raise RunFolderError(message) from error
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            message = f"{self.path} is in use by another process: wait for it, or name another folder by --out"
            raise RunFolderError(message) from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._lock is None:
            return
        if self._is_made_here and [entry.name for entry in self.path.iterdir()] == ["lock"]:
            (self.path / "lock").unlink()
            self.path.rmdir()
        self._lock.close()
        self._lock = None


def _damage(path: Path, raw: bytes, error: Exception) -> str:
    """Return what is wrong with a manifest, and what to try."""
    is_cut = "truncated" in str(error)
    got = f"{len(raw)} bytes that {'break off' if is_cut else 'are not that'} ({error})"
    return (
        f"{path}: expected the JSON object that a run begins with, got {got}: bring the file back from a copy, or leave"
        " this run out; its tables are beside it and can be read without"
    )


def _refuse_strange_optima(path: Path, manifest: Manifest) -> None:
    """Refuse optima that are not one of each goal for each set of rules: figures would be of other rules."""
    n_rules, n_goals = len(manifest.changes) + 1, len(manifest.goals)
    if len(manifest.optima) != n_rules:
        raise RunFolderError(
            f"{path}: expected optima for {n_rules} sets of rules (changes: {n_rules - 1}), got {len(manifest.optima)}"
        )
    for i, optima in enumerate(manifest.optima):
        if len(optima) != n_goals:
            raise RunFolderError(f"{path}: expected optima of {n_goals} goals in optima[{i}], got {len(optima)}")


def _is_left_over(entry: Path) -> bool:
    """Whether a file is what a start that was killed half-way leaves behind."""
    return entry.name in ("lock", MANIFEST_NAME, TAUGHT_NAME) or entry.suffix in (".tmp", SESSION_SUFFIX)
