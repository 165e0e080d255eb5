"""How figures look in print: column and page width, type that stays readable there, colours that stay apart."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from learning.palette import PALETTE, Colour, like
from learning.run_folder import GoalInfo

__all__ = [
    "COLUMN_IN",
    "FORMATS",
    "GREY",
    "PAGE_IN",
    "STYLE",
    "Style",
    "learner_styles",
    "mark_changes",
    "save",
    "spread_widths",
    "styles",
]

FORMATS = ("png", "pdf", "svg")
DPI = 200
COLUMN_IN, PAGE_IN = 3.4, 7.0
"""Widths of a column and of a page of two, as most proceedings have them: figures are printed as they are."""
STYLE: Any = {
    "font.size": 7.0,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.5,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.1,
    "pdf.fonttype": 42,
    "svg.hashsalt": "autotelic",
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.02,
    "figure.constrained_layout.w_pad": 0.02,
}
GREY = "0.45"
DASHES: dict[str, tuple[int, tuple[float, ...]]] = {
    "pressed": (0, ()),
    "grabbed": (0, (4.0, 1.6)),
    "in_box": (0, (1.2, 1.2)),
}
OTHER_DASHES = (DASHES["pressed"], DASHES["grabbed"], DASHES["in_box"], (0, (4.0, 1.2, 1.0, 1.2)))
MARKERS = "osD^vpX*"
POINT = 4.6
NO_DATE = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {"Software": None}}
"""What a file would tell of when it was made."""


class Style:
    """How a line is drawn: a colour, a dash pattern and a marker, any two of which tell it apart."""

    def __init__(self, label: str, *, colour: Colour, dash: tuple[int, tuple[float, ...]], index: int) -> None:
        self.label, self.colour, self.dash = label, colour, dash
        self.marker = MARKERS[index % len(MARKERS)]

    def line(self, width: float) -> dict[str, Any]:
        """Return how its line is drawn."""
        return {
            "color": self.colour,
            "linewidth": width,
            "linestyle": self.dash,
            "marker": self.marker,
            "markersize": 3.4,
            "markeredgecolor": "white",
            "markeredgewidth": 0.4,
        }

    def point(self) -> dict[str, Any]:
        """Return how a point by itself is drawn."""
        return self.line(0.0) | {"markersize": POINT}


def styles(goals: Sequence[GoalInfo]) -> list[Style]:
    """Return each goal's style: a colour that is like its object's, a dash pattern by its kind, a marker of its own."""
    return [
        Style(goal.name.replace("_", " "), colour=colour, dash=DASHES.get(goal.kind, OTHER_DASHES[3]), index=i)
        for i, (goal, colour) in enumerate(zip(goals, like([goal.colour for goal in goals]), strict=True))
    ]


def learner_styles(names: Sequence[str]) -> list[Style]:
    """Return each learner's style, in order: seven colours, then the same again with other dashes."""
    n = len(PALETTE)
    return [
        Style(name, colour=PALETTE[i % n], dash=OTHER_DASHES[(i // n) % len(OTHER_DASHES)], index=i)
        for i, name in enumerate(names)
    ]


def mark_changes(axes: Axes, changes: Sequence[int], n_epochs: int, *, label: bool, zorder: float = 0.5) -> None:
    """Draw where rules change, and how long the run is."""
    axes.set_xlim(0, n_epochs)
    within = [change for change in changes if change < n_epochs]
    for change in within:
        axes.axvline(change, color=GREY, linewidth=0.6, linestyle=(0, (5, 3)), zorder=zorder)
    if label and within:
        at = {"xy": (within[0], 0.0), "xycoords": ("data", "axes fraction"), "ha": "right", "va": "bottom"}
        axes.annotate("rules change", **at, xytext=(-2, 1), textcoords="offset points", color=GREY, fontsize=6.5)


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write a figure in every format and return the files; the same figure gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.{suffix}" for suffix in FORMATS]
    for path in paths:
        with rc_context(STYLE):
            figure.savefig(path, dpi=DPI, metadata=NO_DATE[path.suffix])
    return paths


def spread_widths(n: int, widths: tuple[float, float]) -> list[float]:
    """Return line widths from the first to the last: where lines coincide, wider ones show under narrower."""
    return [float(width) for width in np.linspace(*widths, n)]
