"""Figures of one learner's runs: both panels of the paper's Figure 2, and the curriculum that it made for itself."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from learning.figure_style import COLUMN_IN, GREY, PAGE_IN, STYLE, mark_changes, spread_widths, styles
from learning.report import Group, Run
from learning.rows import EvaluationRow
from learning.statistics import interval_of, median_of

__all__ = ["ABREAST", "curriculum_figure", "performance_figure"]

ABREAST = 2
"""Learners side by side on a page; more make further figures."""
WIDTHS = (2.2, 0.9)
"""Line widths of the first and the last goal."""
MANY = 8
"""Runs from which an interval says more than the range."""
N_BAND_DRAWS, BAND_SEED = 500, 0
SHARE_WINDOWS = 40
"""Parts of a run that shares of goal choices are taken over, each of whole tens of epochs."""


# ------------------------------------------------------------------------------------------------- the paper's Figure 2


def performance_figure(groups: Sequence[Group]) -> Figure:
    """Draw performance (top) and trials needed (bottom) by goal over epochs, a column a learner.

    With several runs the line is the median and the band the range over them; from MANY runs on it is the median's 95 %
    interval by bootstrap.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(_width_in(groups), 3.9))
        axes = figure.subplots(2, len(groups), sharex="col", sharey="row", squeeze=False)
        for column, group in enumerate(groups):
            _draw_performance(axes[0, column], group)
            _draw_trials(axes[1, column], group)
            if len(groups) > 1 or len(group.runs) > 1:
                n = len(group.runs)
                axes[0, column].set_title(f"{group.name}, {_runs_of(n)}", loc="left")
        axes[0, 0].set_ylabel("test epochs achieved")
        axes[1, 0].set_ylabel("trials needed")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside lower center", ncols=2 * len(groups), frameon=False, handlelength=3.2
        )
    return figure


def _width_in(groups: Sequence[Group]) -> float:
    return COLUMN_IN if len(groups) == 1 else PAGE_IN


def _mark(axes: Axes, group: Group, *, label: bool, zorder: float = 0.5) -> None:
    manifest = group.runs[0].manifest
    mark_changes(axes, manifest.changes, manifest.n_epochs, label=label, zorder=zorder)


def _runs_of(n: int) -> str:
    """Return in words how many runs are drawn, and what line and band are of them."""
    band = "" if n == 1 else ": median, 95 % interval" if n >= MANY else ": median, range"
    return f"{n} run{'s' if n > 1 else ''}{band}"


def _draw_performance(axes: Axes, group: Group) -> None:
    _mark(axes, group, label=True)
    _draw_lines(axes, group, lambda row: row.success)
    axes.set_ylim(-0.03, 1.04)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))


def _draw_trials(axes: Axes, group: Group) -> None:
    manifest = group.runs[0].manifest
    _mark(axes, group, label=False)
    edges = [0, *manifest.changes, manifest.n_epochs]
    for start, end, optima in zip(edges, edges[1:], manifest.optima, strict=False):
        for best in sorted({best for best in optima if best is not None}):
            axes.plot([start, end], [best, best], color="0.75", linewidth=0.6, zorder=0)
    _draw_lines(axes, group, lambda row: row.trials_needed)
    axes.set_ylim(0.6, manifest.n_trials + 0.3)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("epochs")
    axes.text(1.0, 1.01, "grey: optimum", transform=axes.transAxes, ha="right", va="bottom", color=GREY, fontsize=6.5)


def _draw_lines(axes: Axes, group: Group, figure_of: Callable[[EvaluationRow], float | None]) -> None:
    goals = group.runs[0].manifest.goals
    widths = spread_widths(len(goals), WIDTHS)
    for index, style in enumerate(styles(goals)):
        epochs, middle, low, high = _over_runs(group.runs, index, figure_of)
        if not len(epochs):
            continue
        if len(group.runs) > 1:
            axes.fill_between(epochs, low, high, color=style.colour, alpha=0.12, linewidth=0)
        is_long = len(epochs) > 2 * len(goals)
        marks = (index, len(goals) + 1) if is_long else (0, 1)  # each goal's markers at other places
        axes.plot(epochs, middle, label=style.label, markevery=marks, **style.line(widths[index]))


def _over_runs(
    runs: Sequence[Run], goal: int, figure_of: Callable[[EvaluationRow], float | None]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return epochs, median, and the band's ends; at a change of rules an epoch comes twice.  (n,) each"""
    values: dict[tuple[int, int], list[float]] = {}
    for run in runs:
        for row in run.evaluation_rows:
            if row.goal == goal and (value := figure_of(row)) is not None:
                values.setdefault((row.epoch, row.rules_epoch), []).append(value)
    keys = sorted(values)
    table = [values[key] for key in keys]
    ends = [_band(entry) for entry in table]
    return (
        np.array([epoch for epoch, _ in keys], dtype=float),
        np.array([np.median(entry) for entry in table]),
        np.array([low for low, _ in ends]),
        np.array([high for _, high in ends]),
    )


def _band(values: list[float]) -> tuple[float, float]:
    """Return least and greatest of few runs, the ends of the median's interval of many."""
    if len(values) >= MANY:
        interval = interval_of(values, rng=np.random.default_rng(BAND_SEED), figure=median_of, n_draws=N_BAND_DRAWS)
        if interval is not None:
            return interval.low, interval.high
    return min(values), max(values)


# ------------------------------------------------------------------------------------------------------- the curriculum


def curriculum_figure(groups: Sequence[Group]) -> Figure:
    """Draw which goals were chosen: each choice of the first run (top), shares over time over all runs (bottom)."""
    with rc_context(STYLE):
        figure = Figure(figsize=(_width_in(groups), 3.4))
        axes = figure.subplots(2, len(groups), sharex="col", sharey="row", squeeze=False)
        for column, group in enumerate(groups):
            _draw_choices(axes[0, column], group)
            _draw_shares(axes[1, column], group)
            if len(groups) > 1:
                axes[0, column].set_title(f"{group.name}, seed {group.runs[0].manifest.seed}", loc="left")
            axes[0, column].set_xlabel("goal of each epoch: coloured achieved, grey missed", color=GREY, fontsize=6.5)
        axes[1, 0].set_ylabel("share of choices")
    return figure


def _draw_choices(axes: Axes, group: Group) -> None:
    """Draw a tick an epoch in the chosen goal's row: upper half where it was achieved, lower half where it was not."""
    run = group.runs[0]
    drawn = styles(run.manifest.goals)
    for index, style in enumerate(drawn):
        hit = [row.epoch for row in run.goal_rows if row.goal == index and row.is_achieved]
        missed = [row.epoch for row in run.goal_rows if row.goal == index and not row.is_achieved]
        row_at = len(drawn) - 1 - index
        axes.vlines(hit, row_at + 0.02, row_at + 0.4, color=style.colour, linewidth=0.5, rasterized=True)
        axes.vlines(missed, row_at - 0.22, row_at - 0.02, color="0.55", linewidth=0.5, rasterized=True)
    axes.set_yticks(range(len(drawn)), [style.label for style in reversed(drawn)])
    axes.set_ylim(-0.5, len(drawn) - 0.4)
    axes.tick_params(axis="y", length=0)
    _mark(axes, group, label=False)


def _draw_shares(axes: Axes, group: Group) -> None:
    n_epochs = max(len(run.goal_rows) for run in group.runs)
    if n_epochs:
        _stack_shares(axes, group, n_epochs)
    axes.set_ylim(0, 1)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    _mark(axes, group, label=False, zorder=3.0)


def _stack_shares(axes: Axes, group: Group, n_epochs: int) -> None:
    drawn = styles(group.runs[0].manifest.goals)
    window = max(10, 10 * round(n_epochs / SHARE_WINDOWS / 10))
    starts = np.arange(0, n_epochs, window)
    shares = np.zeros((len(drawn), len(starts)))
    for run in group.runs:
        for row in run.goal_rows:
            shares[row.goal, row.epoch // window] += 1.0
    shares /= shares.sum(axis=0)
    edges = np.append(starts, n_epochs)
    base = np.zeros(len(starts))
    for share, style in zip(shares[::-1], reversed(drawn), strict=True):
        axes.stairs(base + share, edges, baseline=base, fill=True, color=style.colour, alpha=0.8, label=style.label)
        axes.stairs(base + share, edges, baseline=None, color="white", linewidth=0.7)
        base = base + share
    axes.set_xlabel(f"epochs (shares over {window})")
