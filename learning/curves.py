"""How runs of one learner come along together over epochs, all goals in one: interquartile means, stratified. Pure."""

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from learning.report import Group, Run
from learning.rows import EvaluationRow
from learning.statistics import interval_of, iqm

__all__ = ["Curve", "over_optimum_curve", "success_curve"]

N_DRAWS, SEED = 500, 0
Key = tuple[int, int]
"""Epochs learnt, and whose rules were in force: at a change of rules both sides are looked at."""


class Curve(msgspec.Struct, frozen=True, kw_only=True):
    """A figure at each evaluation, with its 95 % interval where there are three runs or more."""

    epochs: tuple[int, ...]
    values: tuple[float, ...]
    lows: tuple[float, ...]
    highs: tuple[float, ...]


def success_curve(group: Group) -> Curve:
    """Return the share of test epochs achieved."""
    return _curve(group, lambda _run, row: row.success)


def over_optimum_curve(group: Group) -> Curve:
    """Return trials beyond the optimum; an epoch failed or cut short counts as all its trials."""
    return _curve(group, _over_optimum)


def _over_optimum(run: Run, row: EvaluationRow) -> float | None:
    manifest = run.manifest
    best = manifest.optima[sum(change <= row.rules_epoch for change in manifest.changes)][row.goal]
    if best is None or not row.n_all:
        return None
    return (row.trials_all + manifest.n_trials * row.n_void) / row.n_all - best


def _curve(group: Group, figure_of: Callable[[Run, EvaluationRow], float | None]) -> Curve:
    """Take the figure of every goal and run together; runs are drawn anew within each goal, which is a stratum."""
    tables: dict[Key, list[list[float]]] = {}
    for run in group.runs:
        for key, values in _by_evaluation(run, figure_of).items():
            tables.setdefault(key, []).append(values)
    keys = sorted(tables)
    ends = [_with_ends(tables[key]) for key in keys]
    return Curve(
        epochs=tuple(epoch for epoch, _ in keys),
        values=tuple(value for value, _, _ in ends),
        lows=tuple(low for _, low, _ in ends),
        highs=tuple(high for _, _, high in ends),
    )


def _by_evaluation(run: Run, figure_of: Callable[[Run, EvaluationRow], float | None]) -> dict[Key, list[float]]:
    """Return a value a goal for each evaluation; goals that have none are left out."""
    found: dict[Key, list[float]] = {}
    for row in sorted(run.evaluation_rows, key=lambda row: row.goal):
        value = figure_of(run, row)
        if value is not None:
            found.setdefault((row.epoch, row.rules_epoch), []).append(value)
    return found


def _with_ends(table: Sequence[Sequence[float]]) -> tuple[float, float, float]:
    """Return value and ends of the interval; all three the same of few runs, or of runs that differ in their goals."""
    is_whole = len({len(row) for row in table}) == 1
    interval = interval_of(np.array(table), rng=np.random.default_rng(SEED), n_draws=N_DRAWS) if is_whole else None
    if interval is not None:
        return interval.value, interval.low, interval.high
    value = float(iqm(np.array([value for row in table for value in row])))
    return value, value, value
