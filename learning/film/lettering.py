"""Words as pictures, in the type of the figures."""

from functools import lru_cache
from textwrap import wrap

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

__all__ = ["INK", "PAPER", "lettering", "picture_of_figure"]

Picture = NDArray[np.uint8]
DPI = 100
POINTS_PER_INCH = 72.0
INK, PAPER = (0.1, 0.1, 0.12), (1.0, 1.0, 1.0)
WIDE, WIDE_BOLD = 0.58, 0.68
"""Of a letter's height, how wide it is in the mean: to know where a line is full."""
LEADING = 1.35
KEPT = 4096


@lru_cache(maxsize=KEPT)
def lettering(
    text: str, *, width: int, height: int, px: int, bold: bool = False,
    ink: tuple[float, float, float] = INK, paper: tuple[float, float, float] = PAPER,
) -> Picture:  # fmt: skip
    """Return words on paper, from the left, in the middle of the height; what fills a line goes on below.

    Args:
        text: the words.
        width: of the picture, pixels.
        height: likewise.
        px: of a capital's line.
        bold: in heavy type.
        ink: colour of the letters.
        paper: colour behind them.

    Returns:
        (height, width, 3).
    """
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor=paper)
    lines = wrap(text, max(8, int(width / ((WIDE_BOLD if bold else WIDE) * px)))) or [""]
    figure.text(
        0.0, 0.5, "\n".join(lines), ha="left", va="center", color=ink, linespacing=LEADING,
        fontsize=px * POINTS_PER_INCH / DPI, fontweight="bold" if bold else "normal",
    )  # fmt: skip
    return picture_of_figure(figure)


def picture_of_figure(figure: Figure) -> Picture:
    """Return a figure as it is drawn, (h, w, 3) uint8."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
