"""The rows of a run's metrics, as other tools read them: trials, goal choices, evaluations by goal, graph looks."""

import csv
from collections.abc import Iterable
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
        RunFolderError: the file is missing or not such a table.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        message = f"{path}: expected a table of {', '.join(row_type.__struct_fields__)}, got {error.strerror}"
        raise RunFolderError(message) from error
    lines = text[: text.rfind("\n") + 1].splitlines()
    if not lines or lines[0] != header(row_type):
        raise RunFolderError(f"{path}: expected the columns {header(row_type)}, got {lines[0] if lines else 'nothing'}")
    return _parse(path, lines, row_type)


def _parse(path: Path, lines: Iterable[str], row_type: type[R]) -> list[R]:
    entries = [{key: text or None for key, text in entry.items()} for entry in csv.DictReader(lines)]
    try:
        return msgspec.convert(entries, list[row_type], strict=False)
    except msgspec.ValidationError as error:
        message = f"{path}: {error}"
        raise RunFolderError(message) from error


def _cell(value: object) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def _digits(state: GoalState) -> str:
    return "".join("1" if is_on else "0" for is_on in state)
