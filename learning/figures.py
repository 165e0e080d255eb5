"""Figures of runs: both panels of the paper's Figure 2, and the curriculum that the learner made for itself."""

import colorsys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from learning.report import Group, Run
from learning.rows import EvaluationRow
from learning.run_folder import GoalInfo
from learning.statistics import interval_of, median_of

__all__ = ["FORMATS", "Style", "curriculum_figure", "performance_figure", "save", "styles"]

FORMATS = ("png", "pdf")
DPI = 200
STYLE: Any = {
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "legend.fontsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.linewidth": 1.4,
    "pdf.fonttype": 42,
    "figure.constrained_layout.use": True,
}
GREY = "0.45"
DASHES: dict[str, tuple[int, tuple[float, ...]]] = {
    "pressed": (0, ()),
    "grabbed": (0, (4.0, 1.6)),
    "in_box": (0, (1.2, 1.2)),
}
MARKERS = "osD^vpX*"
ALIKE = 0.35
"""RGB distance below which two goals' colours are told apart by lightness."""
WIDTHS = (2.8, 1.2)
"""Line widths of the first and the last goal: where lines coincide, the wider ones show under the narrower."""
MANY = 8
"""Runs from which an interval says more than the range."""
N_BAND_DRAWS, BAND_SEED = 500, 0
SHARE_WINDOWS = 40
"""Parts of a run that shares of goal choices are taken over, each of whole tens of epochs."""


class Style:
    """How a goal is drawn: its object's colour, a dash pattern by its kind, a marker of its own."""

    def __init__(self, goal: GoalInfo, index: int, colour: tuple[float, float, float]) -> None:
        self.label = goal.name.replace("_", " ")
        self.colour = colour
        self.dash = DASHES.get(goal.kind, (0, (3.0, 1.0, 1.0, 1.0)))
        self.marker = MARKERS[index % len(MARKERS)]

    def line(self, width: float) -> dict[str, Any]:
        """Return how its line is drawn."""
        return {
            "color": self.colour,
            "linewidth": width,
            "linestyle": self.dash,
            "marker": self.marker,
            "markersize": 4.5,
            "markeredgecolor": "white",
            "markeredgewidth": 0.5,
        }


def styles(goals: Sequence[GoalInfo]) -> list[Style]:
    """Return each goal's style: goals of like colour are told apart by lightness, all by dash and marker."""
    drawn: list[Style] = []
    for index, goal in enumerate(goals):
        alike = sum(np.linalg.norm(np.subtract(goal.colour, other.colour)) < ALIKE for other in goals[:index])
        drawn.append(Style(goal, index, _shaded(goal.colour, int(alike))))
    return drawn


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure in every format and return the files; the same figure gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.{suffix}" for suffix in FORMATS]
    for path in paths:
        metadata = {"CreationDate": None} if path.suffix == ".pdf" else {"Software": None}
        with rc_context(STYLE):
            figure.savefig(path, dpi=DPI, metadata=metadata)
    return paths


# ------------------------------------------------------------------------------------------------- the paper's Figure 2


def performance_figure(groups: Sequence[Group]) -> Figure:
    """Draw performance (top) and trials needed (bottom) by goal over epochs, a column a learner.

    With several runs the line is the median and the band the range over them; from MANY runs on it is the median's 95 %
    interval by bootstrap.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(max(6.4, 1.2 + 4.0 * len(groups)), 5.6))
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
        figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, handlelength=3.6)
    return figure


def _runs_of(n: int) -> str:
    """Return in words how many runs are drawn, and what line and band are of them."""
    band = "" if n == 1 else ": median, 95 % interval" if n >= MANY else ": median, range"
    return f"{n} run{'s' if n > 1 else ''}{band}"


def _draw_performance(axes: Axes, group: Group) -> None:
    _mark_changes(axes, group, label=True)
    _draw_lines(axes, group, lambda row: row.success)
    axes.set_ylim(-0.03, 1.04)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))


def _draw_trials(axes: Axes, group: Group) -> None:
    manifest = group.runs[0].manifest
    _mark_changes(axes, group, label=False)
    edges = [0, *manifest.changes, manifest.n_epochs]
    for start, end, optima in zip(edges, edges[1:], manifest.optima, strict=False):
        for best in sorted({best for best in optima if best is not None}):
            axes.plot([start, end], [best, best], color="0.75", linewidth=0.6, zorder=0)
    _draw_lines(axes, group, lambda row: row.trials_needed)
    axes.set_ylim(0.6, manifest.n_trials + 0.3)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("epochs")
    axes.text(1.0, 1.01, "grey: optimum", transform=axes.transAxes, ha="right", va="bottom", color=GREY, fontsize=7.5)


def _draw_lines(axes: Axes, group: Group, figure_of: Callable[[EvaluationRow], float | None]) -> None:
    goals = group.runs[0].manifest.goals
    widths = np.linspace(*WIDTHS, len(goals))
    for index, style in enumerate(styles(goals)):
        epochs, middle, low, high = _over_runs(group.runs, index, figure_of)
        if not len(epochs):
            continue
        if len(group.runs) > 1:
            axes.fill_between(epochs, low, high, color=style.colour, alpha=0.12, linewidth=0)
        is_long = len(epochs) > 2 * len(goals)
        marks = (index, len(goals) + 1) if is_long else (0, 1)  # each goal's markers at other places
        axes.plot(epochs, middle, label=style.label, markevery=marks, **style.line(float(widths[index])))


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


def _mark_changes(axes: Axes, group: Group, *, label: bool, zorder: float = 0.5) -> None:
    manifest = group.runs[0].manifest
    axes.set_xlim(0, manifest.n_epochs)
    for change in manifest.changes:
        if change >= manifest.n_epochs:
            continue
        axes.axvline(change, color=GREY, linewidth=0.8, linestyle=(0, (5, 3)), zorder=zorder)
        if label:
            at = {"xy": (change, 1.0), "xycoords": ("data", "axes fraction")}
            axes.annotate("rules change", **at, xytext=(3, 2), textcoords="offset points", color=GREY, fontsize=8)


# ------------------------------------------------------------------------------------------------------- the curriculum


def curriculum_figure(groups: Sequence[Group]) -> Figure:
    """Draw which goals were chosen: each choice of the first run (top), shares over time over all runs (bottom)."""
    with rc_context(STYLE):
        figure = Figure(figsize=(max(6.4, 1.2 + 4.0 * len(groups)), 4.8))
        axes = figure.subplots(2, len(groups), sharex="col", sharey="row", squeeze=False)
        for column, group in enumerate(groups):
            _draw_choices(axes[0, column], group)
            _draw_shares(axes[1, column], group)
            if len(groups) > 1:
                axes[0, column].set_title(f"{group.name}, seed {group.runs[0].manifest.seed}", loc="left")
            axes[0, column].set_xlabel("goal of each epoch: coloured achieved, grey missed", color=GREY, fontsize=7.5)
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
    _mark_changes(axes, group, label=True)


def _draw_shares(axes: Axes, group: Group) -> None:
    n_epochs = max(len(run.goal_rows) for run in group.runs)
    if n_epochs:
        _stack_shares(axes, group, n_epochs)
    axes.set_ylim(0, 1)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    _mark_changes(axes, group, label=False, zorder=3.0)


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


def _shaded(colour: tuple[float, float, float], n_alike: int) -> tuple[float, float, float]:
    """Return a colour that stands out on white, lighter or darker the more goals before it look alike."""
    hue, light, saturation = colorsys.rgb_to_hls(*colour)
    shift = (0.0, 0.2, -0.2, 0.3, -0.3)[n_alike % 5]
    return colorsys.hls_to_rgb(hue, min(0.62, max(0.12, light + shift)), saturation)
