"""One picture of a film: the table, what is said of it, the goals, and the chart up to now. Maths of pixels."""

from collections.abc import Sequence

import msgspec
import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from learning.figure_style import GREY, STYLE, mark_changes, spread_widths, styles
from learning.film.lettering import INK, Picture, lettering, picture_of_figure
from learning.report import Run

__all__ = ["SIZE_PX", "VIEW_PX", "Chart", "GoalLine", "card", "sheet"]

SIZE_PX = (1280, 720)
VIEW_PX = (840, 630)
HEAD_PX, PAD_PX, DOT_PX = 90, 16, 18
CHART_PX = (440, 320)
DIM, STRONG, GOOD = (0.45, 0.45, 0.48), (0.75, 0.2, 0.0), (0.0, 0.42, 0.3)
CURSOR = (40, 40, 40)
MOST_ROW_PX = 48
DPI = 100


class GoalLine(msgspec.Struct, frozen=True, kw_only=True):
    """A goal as the list shows it."""

    name: str
    colour: tuple[float, float, float]
    says: str
    """What is the matter with it now: wanted, tried, achieved; or nothing."""
    is_on: bool


class Chart:
    """Success by goal over epochs, shown up to any of them.

    Args:
        run: whose evaluations are drawn.
    """

    def __init__(self, run: Run) -> None:
        self._n_epochs = max(1, run.summary.n_epochs)
        self._whole, self._edges = _drawn(run, self._n_epochs, with_lines=True)
        self._empty, _ = _drawn(run, self._n_epochs, with_lines=False)

    def until(self, epoch: float) -> Picture:
        """Return the chart with what was known after so many epochs."""
        left, right, top, bottom = self._edges
        at = round(left + (right - left) * min(1.0, epoch / self._n_epochs))
        shown = self._empty.copy()
        shown[:, : at + 1] = self._whole[:, : at + 1]
        shown[top:bottom, at : at + 2] = CURSOR
        return shown


def _drawn(run: Run, n_epochs: int, *, with_lines: bool) -> tuple[Picture, tuple[int, int, int, int]]:
    """Return the chart, and where its axes are in it: left, right, top, bottom."""
    width, height = CHART_PX
    goals = run.manifest.goals
    with rc_context(STYLE | {"font.size": 10.0, "axes.labelsize": 10.0, "xtick.labelsize": 9.0, "ytick.labelsize": 9.0,
                             "figure.constrained_layout.use": False}):  # fmt: skip
        figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI)
        axes = figure.add_axes((0.17, 0.16, 0.79, 0.76))
        for index, (style, line) in enumerate(zip(styles(goals), spread_widths(len(goals), (3.2, 1.4)), strict=True)):
            rows = [row for row in run.evaluation_rows if row.goal == index]
            if with_lines and rows:
                how = style.line(line) | {"marker": None, "solid_capstyle": "round"}
                axes.plot([row.epoch for row in rows], [row.success for row in rows], **how)
        mark_changes(axes, run.manifest.changes, n_epochs, label=False)
        for change in (epoch for epoch in run.manifest.changes if with_lines and epoch < n_epochs):
            axes.annotate("rules change", (change, 1.05), xycoords=("data", "axes fraction"), ha="right", va="center",
                          color=GREY)  # fmt: skip
        axes.set_ylim(-0.03, 1.04)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        axes.set_ylabel("test epochs achieved", color=GREY)
        axes.set_xlabel("epochs learnt", color=GREY)
        picture = picture_of_figure(figure)
    box = axes.get_position()
    edges = (box.x0 * width, box.x1 * width, (1.0 - box.y1) * height, (1.0 - box.y0) * height)
    left, right, top, bottom = (round(edge) for edge in edges)
    return picture, (left, right, top, bottom)


def sheet(view: Picture, *, title: str, says: str, now: str, goals: Sequence[GoalLine], chart: Picture) -> Picture:
    """Return one picture of the film.  view: (630, 840, 3) -> (720, 1280, 3)

    Args:
        view: arm and table.
        title: of the scene.
        says: of the scene, below its title.
        now: what is going on at this instant, over the goals.
        goals: all of them.
        chart: success up to now.
    """
    page = _page(title, says)
    width, height = VIEW_PX
    page[HEAD_PX : HEAD_PX + height, :width] = view
    _put(page, chart, x=width, y=HEAD_PX)
    begin = HEAD_PX + CHART_PX[1]
    beside = SIZE_PX[0] - width - 2 * PAD_PX
    _put(page, lettering(now, width=beside, height=44, px=18, bold=True), x=width + PAD_PX, y=begin)
    _list(page, goals, x=width + PAD_PX, y=begin + 48, width=beside)
    return page


def card(*, title: str, says: str, chart: Picture) -> Picture:
    """Return a picture of words and the chart, where nothing moves."""
    page = np.full((SIZE_PX[1], SIZE_PX[0], 3), 255, np.uint8)
    wide = SIZE_PX[0] - CHART_PX[0] - 7 * PAD_PX
    _put(page, lettering(title, width=wide, height=130, px=42, bold=True), x=3 * PAD_PX, y=220)
    _put(page, lettering(says, width=wide, height=140, px=26, ink=DIM), x=3 * PAD_PX, y=360)
    _put(page, chart, x=SIZE_PX[0] - CHART_PX[0] - PAD_PX, y=(SIZE_PX[1] - CHART_PX[1]) // 2)
    return page


def _page(title: str, says: str) -> Picture:
    page = np.full((SIZE_PX[1], SIZE_PX[0], 3), 255, np.uint8)
    wide = SIZE_PX[0] - 2 * PAD_PX
    _put(page, lettering(title, width=wide, height=46, px=28, bold=True), x=PAD_PX, y=2)
    _put(page, lettering(says, width=wide, height=40, px=20, ink=DIM), x=PAD_PX, y=48)
    return page


def _list(page: Picture, goals: Sequence[GoalLine], *, x: int, y: int, width: int) -> None:
    row = min(MOST_ROW_PX, (SIZE_PX[1] - y - 4) // max(1, len(goals)))
    px = max(9, min(18, row - 10))
    for i, goal in enumerate(goals):
        top = y + i * row
        dot = min(DOT_PX, row - 6)
        middle = top + (row - dot) // 2
        page[middle : middle + dot, x : x + dot] = (np.array(goal.colour) * 255).astype(np.uint8)
        if not goal.is_on:  # a frame where it does not hold, all of it where it does
            page[middle + 3 : middle + dot - 3, x + 3 : x + dot - 3] = 255
        ink = GOOD if goal.is_on else STRONG if goal.says else INK
        name = lettering(goal.name, width=width // 2 + 30 - dot, height=row, px=px, ink=ink, bold=bool(goal.says))
        _put(page, name, x=x + dot + 8, y=top)
        _put(
            page, lettering(goal.says, width=width // 2 - 46, height=row, px=px, ink=ink), x=x + width // 2 + 38, y=top
        )


def _put(page: Picture, part: Picture, *, x: int, y: int) -> None:
    height, width = part.shape[:2]
    page[y : y + height, x : x + width] = part
