"""Runs read back from their folders and put side by side: figures of merit over seeds, grouped by learner. Pure."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import combinations
from pathlib import Path
from statistics import median
from typing import TypeVar

import msgspec
import numpy as np

from learning.errors import RunFolderError
from learning.metrics import EraSummary, Summary, summarise
from learning.rows import EvaluationRow, GoalRow
from learning.run_folder import Manifest, RunFolder
from learning.run_search import find_runs
from learning.statistics import Interval, Reached, interval_of, probability_of_improvement, reached_by_half
from learning.stops import Stops

__all__ = [
    "Comparison",
    "Count",
    "EraReport",
    "Group",
    "GroupReport",
    "Loaded",
    "Report",
    "Run",
    "Spread",
    "group_runs",
    "load_run",
    "load_runs",
    "report_of",
]

Part = TypeVar("Part")


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """One run as its folder tells it."""

    folder: str
    manifest: Manifest
    goal_rows: tuple[GoalRow, ...]
    evaluation_rows: tuple[EvaluationRow, ...]
    summary: Summary
    stops: Stops | None = None
    """What stopped the arm; None where that was not kept."""


class Loaded(msgspec.Struct, frozen=True, kw_only=True):
    """Runs read back, and what could not be."""

    runs: tuple[Run, ...]
    left_out: tuple[str, ...]
    """Of each run that cannot be read, what is wrong with it, in a line."""
    passed_over: tuple[str, ...]
    """Of each folder beside them that is no run's but holds something of one, what it holds, in a line; and of each run
    that was named before."""

    def lines(self) -> list[str]:
        """Return in words what was not read, a line each."""
        return [
            *(f"error: left out: {reason}" for reason in self.left_out),
            *(f"passed over: {note}" for note in self.passed_over),
        ]


class Group(msgspec.Struct, frozen=True, kw_only=True):
    """Runs of one learner on one scenario; they differ by seed."""

    name: str
    runs: tuple[Run, ...]


class Count(msgspec.Struct, frozen=True, kw_only=True):
    """So many of so many runs, with the 95 % interval of the share behind it."""

    n: int
    of: int
    share_low: float
    share_high: float


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """Median and range over the runs that have a figure: n of so many. None of the three where none has."""

    median: float | None
    least: float | None
    greatest: float | None
    n: int
    of: int
    middle: Interval | None = None
    """Interquartile mean with its 95 % interval, where every run has a figure and there are three or more."""


class EraReport(msgspec.Struct, frozen=True, kw_only=True):
    """One set of rules over all runs of a group."""

    from_epoch: int
    n_runs: int
    """Runs of the group that came to these rules: all that follows is of so many."""
    learnt: Count
    learnt_after: Spread
    learnt_by_half: Reached | None = None
    """Median over all runs, those that never learnt counting as later than all; None of fewer runs than three."""
    graph_right: Count | None
    """None where no run learns a graph."""
    graph_right_after: Spread
    graph_wrong_later: Spread
    """Share of the looks after that at which it was wrong again."""
    trials_over_optimum: Spread
    """Mean over goals."""
    trials_over_optimum_worst: Spread
    """Of the goal that has the most."""
    trials_over_optimum_of_successes: Spread
    success: Spread
    """Of the least successful goal over an era's last 200 epochs."""


class GroupReport(msgspec.Struct, frozen=True, kw_only=True):
    """All runs of one learner."""

    name: str
    seeds: tuple[int, ...]
    eras: tuple[EraReport, ...]
    time_steps_to_all: Spread | None = None
    """Decisions while learning until every goal was learnt under the first rules."""


class Comparison(msgspec.Struct, frozen=True, kw_only=True):
    """How surely a run of one learner is better than one of another under one set of rules (0.5: as good)."""

    ours: str
    theirs: str
    from_epoch: int
    success: Interval | None
    """More success of the least successful goal."""
    trials: Interval | None
    """Fewer trials over the optimum."""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """What `autotelic report` writes."""

    groups: tuple[GroupReport, ...]
    comparisons: tuple[Comparison, ...] = ()
    """Of each learner with each that came after it."""
    runs: tuple[tuple[str, Summary], ...]
    """Folder and figures of each run."""
    stops: tuple[tuple[str, Stops], ...] = ()
    """Folder of each run that kept them, and what stopped its arm."""
    protective_per_1000_epochs: float | None = None
    """Protective stops of all of them in a thousand epochs; None where none kept any."""


def load_run(folder: RunFolder) -> Run:
    """Return a run, finished or not.

    Raises:
        RunFolderError: the folder or one of its tables cannot be read, or a table tells of what the run has not.
    """
    manifest = folder.manifest()
    goal_rows, evaluation_rows = folder.goals(), folder.evaluations()
    _refuse_strange(folder.path / "goals.csv", goal_rows, len(manifest.goals))
    _refuse_strange(folder.path / "evaluations.csv", evaluation_rows, len(manifest.goals))
    for i, row in enumerate(goal_rows):
        if row.epoch != i:
            raise RunFolderError(f"{folder.path / 'goals.csv'}: line {i + 2}: expected epoch {i}, got {row.epoch}")
    summary = summarise(
        goal_rows,
        evaluation_rows,
        folder.graphs(),
        n_goals=len(manifest.goals),
        from_epochs=[goal.from_epoch for goal in manifest.goals],
        n_trials=manifest.n_trials,
        changes=manifest.changes,
        optima=manifest.optima,
    )
    return Run(
        folder=str(folder.path),
        manifest=manifest,
        goal_rows=tuple(goal_rows),
        evaluation_rows=tuple(evaluation_rows),
        summary=summary,
        stops=folder.stops(),
    )


def _refuse_strange(path: Path, rows: Sequence[GoalRow | EvaluationRow], n_goals: int) -> None:
    """Refuse a table that tells of a goal that there is not."""
    for i, row in enumerate(rows, 2):
        if not 0 <= row.goal < n_goals:
            raise RunFolderError(f"{path}: line {i}: expected a goal from 0 to {n_goals - 1}, got {row.goal}")


def load_runs(paths: Sequence[Path]) -> Loaded:
    """Return the runs that paths name, run folders and folders of them, in order.

    Inside a folder of runs those that cannot be read are left out. A run that is named twice counts once.

    Raises:
        RunFolderError: a path names no run, or is itself the folder of a run that cannot be read.
    """
    runs: list[Run] = []
    seen: set[Path] = set()
    damaged: list[str] = []
    passed_over: list[str] = []
    for path in paths:
        found = find_runs(path)
        damaged += found.broken
        passed_over += found.passed_over
        for folder in found.folders:
            whole = folder.path.resolve()
            if whole in seen:
                passed_over.append(f"{folder.path}: named before, counted once")
                continue
            seen.add(whole)
            try:
                runs.append(load_run(folder))
            except RunFolderError as error:
                if folder.path == path:
                    raise
                damaged.append(str(error))
    return Loaded(runs=tuple(runs), left_out=tuple(damaged), passed_over=tuple(passed_over))


def group_runs(runs: Sequence[Run]) -> list[Group]:
    """Return the runs grouped by learner (and scenario where there is more than one), in the order they came.

    Raises:
        RunFolderError: runs of one group have other goals or other changes of rules.
    """
    scenarios = {run.manifest.scenario for run in runs}
    by_name: dict[str, list[Run]] = {}
    for run in runs:
        of_scenario = f", {run.manifest.scenario}" if len(scenarios) > 1 else ""
        by_name.setdefault(run.manifest.learner + of_scenario, []).append(run)
    for name, members in by_name.items():
        first = members[0].manifest
        for run in members[1:]:
            if (run.manifest.goals, run.manifest.changes) != (first.goals, first.changes):
                raise RunFolderError(f"{run.folder}: expected the goals and changes of {members[0].folder} ({name})")
    return [Group(name=name, runs=tuple(members)) for name, members in by_name.items()]


def report_of(groups: Sequence[Group], *, rng: np.random.Generator | None = None) -> Report:
    """Return the figures of all groups; rng draws runs anew for intervals, of which there are none without it."""
    kept = [(run.folder, run.stops) for group in groups for run in group.runs if run.stops is not None]
    return Report(
        groups=tuple(_report_group(group, rng) for group in groups),
        comparisons=() if rng is None else tuple(_comparisons(groups, rng)),
        runs=tuple((run.folder, run.summary) for group in groups for run in group.runs),
        stops=tuple(kept),
        protective_per_1000_epochs=sum((stops for _, stops in kept), Stops()).protective_per_1000_epochs
        if kept
        else None,
    )


def _eras(group: Group) -> list[list[EraSummary]]:
    """Return the runs' figures under each set of rules, of those that came to it."""
    n_eras = max(len(run.summary.eras) for run in group.runs)
    return [[run.summary.eras[i] for run in group.runs if i < len(run.summary.eras)] for i in range(n_eras)]


def _report_group(group: Group, rng: np.random.Generator | None) -> GroupReport:
    return GroupReport(
        name=group.name,
        seeds=tuple(run.manifest.seed for run in group.runs),
        eras=tuple(_report_era(parts, rng) for parts in _eras(group)),
        time_steps_to_all=_spread([run.summary for run in group.runs], rng, lambda summary: summary.time_steps_to_all),
    )


def _comparisons(groups: Sequence[Group], rng: np.random.Generator) -> Iterator[Comparison]:
    for ours, theirs in combinations(groups, 2):
        for i in range(min(len(_eras(ours)), len(_eras(theirs)))):
            yield _compare(ours, theirs, i, rng)


def _compare(ours: Group, theirs: Group, i: int, rng: np.random.Generator) -> Comparison:
    """Compare two groups under their i-th sets of rules."""
    a, b = _eras(ours)[i], _eras(theirs)[i]

    def better(figure: Callable[[EraSummary], float | None]) -> Interval | None:
        of_ours, of_theirs = ([v for part in parts if (v := figure(part)) is not None] for parts in (a, b))
        is_whole = len(of_ours) == len(a) and len(of_theirs) == len(b)
        return probability_of_improvement(of_ours, of_theirs, rng=rng) if is_whole else None

    return Comparison(
        ours=ours.name, theirs=theirs.name, from_epoch=a[0].from_epoch, success=better(_least_success),
        trials=better(lambda part: None if part.trials_over_optimum is None else -part.trials_over_optimum),
    )  # fmt: skip


def _least_success(part: EraSummary) -> float | None:
    return min((s for s in part.success_by_goal if s is not None), default=None)


def _report_era(parts: Sequence[EraSummary], rng: np.random.Generator | None) -> EraReport:
    spread = partial(_spread, parts, rng)
    has_graph = any(part.graph_wrong_last is not None for part in parts)
    return EraReport(
        from_epoch=parts[0].from_epoch,
        n_runs=len(parts),
        learnt=count(sum(part.learnt_after is not None for part in parts), len(parts)),
        learnt_after=spread(lambda part: part.learnt_after),
        learnt_by_half=None if rng is None else reached_by_half([part.learnt_after for part in parts], rng=rng),
        graph_right=count(sum(part.graph_right_after is not None for part in parts), len(parts)) if has_graph else None,
        graph_right_after=spread(lambda part: part.graph_right_after),
        graph_wrong_later=spread(lambda part: part.graph_wrong_later),
        trials_over_optimum=spread(lambda part: part.trials_over_optimum),
        trials_over_optimum_worst=spread(lambda part: part.trials_over_optimum_worst),
        trials_over_optimum_of_successes=spread(lambda part: part.trials_over_optimum_of_successes),
        success=spread(_least_success),
    )


def _spread(parts: Sequence[Part], rng: np.random.Generator | None, figure: Callable[[Part], float | None]) -> Spread:
    values = [value for part in parts if (value := figure(part)) is not None]
    return Spread(
        median=median(values) if values else None,
        least=min(values, default=None),
        greatest=max(values, default=None),
        n=len(values),
        of=len(parts),
        middle=interval_of(values, rng=rng) if rng is not None and len(values) == len(parts) else None,
    )


def count(n: int, of: int) -> Count:
    """Return a count with Wilson's 95 % interval of its share."""
    if of == 0:
        return Count(n=0, of=0, share_low=0.0, share_high=1.0)
    from scipy.stats import binomtest  # seconds that most commands do not need

    share = binomtest(n, of).proportion_ci(confidence_level=0.95, method="wilson")
    return Count(n=n, of=of, share_low=max(0.0, float(share.low)), share_high=min(1.0, float(share.high)))
