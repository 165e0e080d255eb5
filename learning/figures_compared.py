"""Figures of learners side by side: all goals in one curve, epochs to learn and to recover, who is surely better."""

from collections.abc import Sequence

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from learning.curves import Curve, over_optimum_curve, success_curve
from learning.figure_style import COLUMN_IN, GREY, PAGE_IN, STYLE, Style, learner_styles, mark_changes
from learning.report import Comparison, EraReport, Group, Report
from learning.statistics import Interval

__all__ = ["epochs_figure", "improvement_figure", "learners_figure"]

FEW = 4
"""Learners whose names stand below one another in a column's width."""
ROW_IN, FRAME_IN = 0.17, 0.62
LEAST_TRIALS = 0.5
"""Trials over the optimum that the axis shows at least."""


def learners_figure(groups: Sequence[Group]) -> Figure:
    """Draw success (top) and trials over the optimum (bottom) of all goals together, a line a learner.

    Lines are interquartile means over goals and runs, bands their 95 % intervals by stratified bootstrap.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(COLUMN_IN if len(groups) <= FEW else PAGE_IN, 3.6))
        top, bottom = figure.subplots(2, 1, sharex=True)
        for group, style in zip(groups, learner_styles([group.name for group in groups]), strict=True):
            _draw(top, success_curve(group), style, label=f"{group.name} ({len(group.runs)})")
            _draw(bottom, over_optimum_curve(group), style)
        longest = max((group.runs[0].manifest for group in groups), key=lambda manifest: manifest.n_epochs)
        for axes in (top, bottom):
            mark_changes(axes, longest.changes, longest.n_epochs, label=axes is top)
        top.set_ylabel("test epochs achieved")
        top.set_ylim(-0.03, 1.04)
        top.yaxis.set_major_formatter(PercentFormatter(1.0))
        bottom.set_ylabel("trials over the optimum")
        bottom.set_ylim(-0.05 * max(LEAST_TRIALS, bottom.get_ylim()[1]), max(LEAST_TRIALS, bottom.get_ylim()[1]))
        bottom.set_xlabel("epochs")
        figure.legend(
            *top.get_legend_handles_labels(), loc="outside lower center", frameon=False, handlelength=3.2,
            ncols=2 if len(groups) <= FEW else 5, title="learner (runs)", title_fontsize=7.0,
        )  # fmt: skip
    return figure


def _draw(axes: Axes, curve: Curve, style: Style, label: str | None = None) -> None:
    if not curve.epochs:
        return
    if curve.lows != curve.values or curve.highs != curve.values:
        axes.fill_between(curve.epochs, curve.lows, curve.highs, color=style.colour, alpha=0.18, linewidth=0)
    marks = max(1, len(curve.epochs) // 8)
    axes.plot(curve.epochs, curve.values, label=label, markevery=marks, **style.line(1.2))


# --------------------------------------------------------------------------------------------- epochs until it was so


def epochs_figure(report: Report) -> Figure:
    """Draw after how many epochs half of a learner's runs had learnt, or recovered, a row a learner and set of rules.

    The bar is the 95 % interval; an arrow says that it ends nowhere, for too many runs never came there. At the right
    edge stands how many did.
    """
    rows = [(group.name, era) for group in report.groups for era in group.eras]
    drawn = dict(
        zip([group.name for group in report.groups], learner_styles([g.name for g in report.groups]), strict=True)
    )
    with rc_context(STYLE):
        figure = Figure(figsize=(COLUMN_IN, FRAME_IN + ROW_IN * max(2, len(rows))))
        axes = figure.subplots()
        latest = max((known for _, era in rows for known in _known(era)), default=1.0)
        for at, (name, era) in enumerate(rows):
            _draw_reached(axes, at, era, drawn[name], latest)
        axes.set_yticks(range(len(rows)), [_row_name(name, era) for name, era in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_xlim(0, 1.12 * latest)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
        axes.set_xlabel("epochs to mastery: median, 95 % interval")
        axes.grid(axis="x", color="0.9", linewidth=0.5)
        axes.set_axisbelow(True)
        axes.tick_params(axis="y", length=0)
    return figure


def _row_name(name: str, era: EraReport) -> str:
    return f"{name}, from {era.from_epoch}"


def _known(era: EraReport) -> list[float]:
    reached = era.learnt_by_half
    whole = () if reached is None else (reached.value, reached.low, reached.high)
    return [value for value in (*whole, era.learnt_after.median) if value is not None]


def _draw_reached(axes: Axes, at: int, era: EraReport, style: Style, latest: float) -> None:
    """Draw one row; what half of the runs never reached has no point."""
    reached, edge = era.learnt_by_half, 1.1 * latest
    if reached is None:
        value = era.learnt_after.median if era.learnt_after.n == era.learnt_after.of else None
    else:
        value = reached.value
        if reached.low is not None:
            end = edge if reached.high is None else reached.high
            axes.plot([reached.low, end], [at, at], color=style.colour, linewidth=2.2, alpha=0.5, solid_capstyle="butt")
        if reached.high is None:
            axes.plot([edge], [at], marker=">", color=style.colour, markersize=4, clip_on=False)
    if value is not None:
        axes.plot([value], [at], **style.point())
    told = f"{era.learnt.n}/{era.learnt.of}"
    axes.annotate(told, (1.0, at), xycoords=("axes fraction", "data"), xytext=(4, 0), textcoords="offset points",
                  va="center", fontsize=6.5, color="0.25", annotation_clip=False)  # fmt: skip


# ------------------------------------------------------------------------------------------------ who is surely better


def improvement_figure(comparisons: Sequence[Comparison]) -> Figure:
    """Draw how surely a run of one learner has more success (left), or needs fewer trials (right), than one of another.

    A row a pair and set of rules; on the line in the middle both are as good.
    """
    with rc_context(STYLE):
        figure = Figure(figsize=(PAGE_IN, FRAME_IN + ROW_IN * max(2, len(comparisons))))
        left, right = figure.subplots(1, 2, sharey=True)
        colours = learner_styles(["success", "trials"])
        for axes, style, title in ((left, colours[0], "more success"), (right, colours[1], "fewer trials")):
            axes.axvline(0.5, color=GREY, linewidth=0.6, linestyle=(0, (5, 3)))
            axes.set_xlim(-0.02, 1.02)
            axes.xaxis.set_major_formatter(PercentFormatter(1.0))
            axes.set_title(title, loc="left")
            axes.set_xlabel("probability, 95 % interval")
            axes.tick_params(axis="y", length=0)
            for at, row in enumerate(comparisons):
                _draw_interval(axes, at, row.success if axes is left else row.trials, style)
        names = [f"{row.ours} over {row.theirs}, from {row.from_epoch}" for row in comparisons]
        left.set_yticks(range(len(names)), names)
        left.set_ylim(len(names) - 0.4, -0.6)
    return figure


def _draw_interval(axes: Axes, at: int, interval: Interval | None, style: Style) -> None:
    if interval is None:
        return
    axes.plot(
        [interval.low, interval.high], [at, at], color=style.colour, linewidth=2.2, alpha=0.5, solid_capstyle="butt"
    )
    axes.plot([interval.value], [at], **style.point())
