"""The rows of a run's metrics, as other tools read them: trials, goal choices, evaluations by goal, graph looks."""

from pathlib import Path
from typing import TypeVar

import msgspec

from learning.agent import EpochRecord
from learning.errors import RunFolderError
from learning.interfaces import GoalState, TrialOutcome

__all__ = [
    "EvaluationRow",
    "GoalRow",
    "GraphRow",
    "Row",
    "TrialRow",
    "cells",
    "goal_row",
    "header",
    "read_rows",
    "trial_rows",
]


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all rows: flat, one column a field."""


class TrialRow(Row, frozen=True, kw_only=True):
    """One trial at a sub-goal while learning."""

    epoch: int
    trial: int
    """Counted from 1 within the epoch."""
    goal: int
    subgoal: int
    state: str
    """Goals latched before the trial, one digit a goal."""
    state_after: str
    outcome: TrialOutcome
    n_steps: int
    predicted: float
    skill: float
    temperature: float


class GoalRow(Row, frozen=True, kw_only=True):
    """One goal choice: an epoch of learning."""

    epoch: int
    goal: int
    is_achieved: int
    is_void: int
    n_trials: int
    n_steps: int


class EvaluationRow(Row, frozen=True, kw_only=True):
    """One goal at one evaluation: learning off, fresh seeds."""

    epoch: int
    """Epochs learnt so far."""
    rules_epoch: int
    """Epoch whose rules were in force; at a change of rules both sides are looked at."""
    goal: int
    n_tests: int
    """Test epochs that were seen to the end."""
    n_successes: int
    n_void: int
    """Test epochs cut short, by a latch or because what the hand held slipped away: further ones were run instead."""
    trials_achieved: int
    """Trials needed, summed over the successes."""
    trials_all: int
    """Trials needed, summed over the tests seen to the end; a failure counts as all trials of an epoch."""
    n_steps: int
    graph_cases: int | None
    """Reachable goal-states at which the learnt graph's prediction for this goal was compared with the rules."""
    graph_wrong: int | None

    @property
    def n_all(self) -> int:
        """Test epochs, those cut short among them."""
        return self.n_tests + self.n_void

    @property
    def success(self) -> float:
        """Share of all test epochs that succeeded: one cut short failed. 0 where there was none."""
        return self.n_successes / self.n_all if self.n_all else 0.0

    @property
    def trials_needed(self) -> float | None:
        """Mean trials over the tests seen to the end, failures counting as all trials."""
        return self.trials_all / self.n_tests if self.n_tests else None


class GraphRow(Row, frozen=True, kw_only=True):
    """One look at the learnt graph: what it predicts against what the rules say."""

    epoch: int
    """Epochs learnt so far."""
    rules_epoch: int
    n_cases: int
    """Goals times goal-states that can be reached."""
    n_wrong: int


R = TypeVar("R", bound=Row)
SHOWN = 60
"""Characters of a wrong line that its error quotes."""


def trial_rows(record: EpochRecord) -> list[TrialRow]:
    """Return the rows of an epoch's trials."""
    return [
        TrialRow(
            epoch=record.epoch,
            trial=entry.trial,
            goal=entry.attempt.goal,
            subgoal=entry.attempt.subgoal,
            state=_digits(entry.attempt.state),
            state_after=_digits(entry.attempt.state_after),
            outcome=entry.attempt.outcome,
            n_steps=entry.attempt.n_steps,
            predicted=entry.attempt.predicted,
            skill=entry.attempt.skill,
            temperature=entry.temperature,
        )
        for entry in record.trials
    ]


def goal_row(record: EpochRecord) -> GoalRow:
    """Return the row of an epoch's goal choice."""
    return GoalRow(
        epoch=record.epoch,
        goal=record.goal,
        is_achieved=int(record.is_achieved),
        is_void=int(record.is_void),
        n_trials=len(record.trials),
        n_steps=record.n_steps,
    )


def header(row_type: type[Row]) -> str:
    """Return the header line of a table, without its line end."""
    return ",".join(row_type.__struct_fields__)


def cells(row: Row) -> str:
    """Return one row as a line without its line end; floats so that they read back bit for bit."""
    return ",".join(_cell(getattr(row, name)) for name in row.__struct_fields__)


def read_rows(path: Path, row_type: type[R]) -> list[R]:
    """Return a table's rows. A torn last line (the writer was killed) is left out.

    Raises:
        RunFolderError: the file is missing or not such a table; the message names file and line.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        message = f"{path}: expected a table of {', '.join(row_type.__struct_fields__)}, got {error.strerror}"
        raise RunFolderError(message) from error
    lines = _lines(path, raw[: raw.rfind(b"\n") + 1])
    if not lines or lines[0] != header(row_type):
        got = repr(lines[0][:SHOWN]) if lines else "nothing"
        raise RunFolderError(f"{path}: expected the columns {header(row_type)}, got {got}")
    names = row_type.__struct_fields__
    entries = [_entry(path, i, line, names) for i, line in enumerate(lines[1:], 2)]
    try:
        return msgspec.convert(entries, list[row_type], strict=False)
    except msgspec.ValidationError:
        return [_row(path, i, entry, row_type) for i, entry in enumerate(entries, 2)]


def _lines(path: Path, raw: bytes) -> list[str]:
    """Return the whole lines without their ends."""
    try:
        text = raw.decode()
    except UnicodeDecodeError as error:
        i = raw.count(b"\n", 0, error.start) + 1
        message = f"{path}: line {i}: expected UTF-8 text, got {raw[error.start : error.start + 1]!r}"
        raise RunFolderError(message) from error
    return [line.rstrip("\r") for line in text.split("\n")[:-1]]


def _entry(path: Path, i: int, line: str, names: tuple[str, ...]) -> dict[str, str | None]:
    entries = line.split(",")
    if len(entries) != len(names) or "\0" in line:
        raise RunFolderError(f"{path}: line {i}: expected {len(names)} cells of text, got {line[:SHOWN]!r}")
    return {name: entry or None for name, entry in zip(names, entries, strict=True)}


def _row(path: Path, i: int, entry: dict[str, str | None], row_type: type[R]) -> R:
    try:
        return msgspec.convert(entry, row_type, strict=False)
    except msgspec.ValidationError as error:
        message = f"{path}: line {i}: {error}"
        raise RunFolderError(message) from error


def _cell(value: object) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def _digits(state: GoalState) -> str:
    return "".join("1" if is_on else "0" for is_on in state)
