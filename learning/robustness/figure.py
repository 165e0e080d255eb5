"""What a run bears, drawn: a panel a goal, a row a case, with intervals."""

from collections.abc import Sequence
from textwrap import fill

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from learning.figure_style import GREY, PAGE_IN, STYLE, Style, learner_styles
from learning.report import Count
from learning.robustness.result import Robustness

__all__ = ["robustness_figure"]

ABREAST = 6
TITLE = 14
"""Letters in a line over a panel."""
"""Panels in a row."""
ROW_IN, FRAME_IN = 0.19, 0.75
APART = 0.17
"""Between what is told before and after, in rows."""


def robustness_figure(told: Robustness) -> Figure:
    """Draw the share of test epochs achieved, learning off and after going on to learn, with Wilson's 95 % intervals.

    The dotted line is what the run achieves where nothing was changed.
    """
    n_goals = len(told.goals)
    n_rows, n_columns = -(-n_goals // ABREAST), min(n_goals, ABREAST)
    names = ["learning off", f"after {told.plan.n_more} epochs under it"]
    with rc_context(STYLE):
        height = FRAME_IN + n_rows * (0.2 + ROW_IN * len(told.cases))
        figure = Figure(figsize=(PAGE_IN, height))
        panels = figure.subplots(n_rows, n_columns, sharex=True, sharey=True, squeeze=False)
        before, after = learner_styles(names)
        for goal, info in enumerate(told.goals):
            axes = panels[goal // ABREAST, goal % ABREAST]
            axes.set_title(fill(info.name.replace("_", " "), TITLE), loc="left")
            axes.axvline(told.cases[0].before[goal].n / max(1, told.cases[0].before[goal].of), color=GREY,
                         linewidth=0.6, linestyle=(0, (1, 2)))  # fmt: skip
            _draw(axes, [case.before[goal] for case in told.cases], before, -APART)
            if told.plan.n_more:
                _draw(axes, [case.after[goal] for case in told.cases], after, APART)
        for spare in panels.flat[n_goals:]:
            spare.set_visible(False)
        _dress(panels[0, 0], [case.says for case in told.cases])
        for axes in panels[-1]:
            axes.set_xlabel("% achieved")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _dress(axes: Axes, says: Sequence[str]) -> None:
    axes.set_yticks(range(len(says)), says)
    axes.set_ylim(len(says) - 0.5, -0.5)
    axes.set_xlim(-0.04, 1.04)
    axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100"])


def _draw(axes: Axes, counts: Sequence[Count], style: Style, off: float) -> None:
    axes.tick_params(axis="y", length=0)
    rows = [row + off for row in range(len(counts))]
    lows, highs = [entry.share_low for entry in counts], [entry.share_high for entry in counts]
    axes.hlines(rows, lows, highs, color=style.colour, linewidth=1.8, alpha=0.45)
    axes.plot([entry.n / max(1, entry.of) for entry in counts], rows, label=style.label, **style.line(0.0))
