"""A picture of what a lens was calibrated from: corners over the frame, ninths that lack some, blur and residual."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from perception.calibration.board import Board
from perception.calibration.gates import AREA_NAMES, LEAST_IN_AREA, MOST_BLUR_PX, N_AREAS, covered, is_usable
from perception.calibration.sighting import Sighting, pixels_of

if TYPE_CHECKING:
    from matplotlib.patches import Rectangle

__all__ = ["draw_coverage"]

USED, UNUSED, BARE = "#1f6f8b", "#c06014", "#f3d9cf"


def draw_coverage(path: Path, board: Board, sightings: list[Sighting]) -> None:
    """Write a picture of where corners were seen and which views count; for good and bad sets alike."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    where, sharp = figure.subplots(1, 2, width_ratios=(3, 2))
    usable = [s for s in sightings if is_usable(board, s)]
    width, height = (sightings[0].width_px, sightings[0].height_px) if sightings else (16, 9)
    counts = covered(usable, N_AREAS)
    step_x, step_y = width / N_AREAS[0], height / N_AREAS[1]
    for index, name in enumerate(AREA_NAMES):
        row, column = divmod(index, N_AREAS[0])
        n = int(counts[row, column])
        face = "#ffffff" if n >= LEAST_IN_AREA else BARE
        left, upper = column * step_x, row * step_y
        where.add_patch(_box(left, upper, step_x, step_y, face))
        where.text(left + 0.02 * width, upper + 0.06 * height, f"{name}: {n}", fontsize=8, color="#555555")
    for sighting in sightings:
        pixels, is_used = pixels_of(sighting), is_usable(board, sighting)
        where.plot(pixels[:, 0], pixels[:, 1], ".", markersize=3, color=USED if is_used else UNUSED)
    where.set(xlim=(0, width), ylim=(height, 0), aspect="equal", xlabel="px", ylabel="px")
    where.set_title(f"corners of {len(usable)} usable views of {len(sightings)} ({LEAST_IN_AREA} wanted in each ninth)")
    blurs = [min(s.blur_px, 2 * MOST_BLUR_PX) for s in sightings]
    colours = [USED if is_usable(board, s) else UNUSED for s in sightings]
    sharp.barh(np.arange(len(blurs)), blurs, color=colours)
    sharp.axvline(MOST_BLUR_PX, color="#888888", linewidth=1)
    names = [f"{s.image} ({len(s.corners)})" for s in sightings]
    sharp.set_yticks(np.arange(len(names)), labels=names, fontsize=6)
    sharp.set(xlabel="blur of the squares' edges, px", xlim=(0, 2 * MOST_BLUR_PX))
    sharp.set_title("views (corners), blue: used")
    sharp.invert_yaxis()
    figure.savefig(path, dpi=110)


def _box(left: float, upper: float, width: float, height: float, face: str) -> "Rectangle":
    from matplotlib.patches import Rectangle

    return Rectangle((left, upper), width, height, facecolor=face, edgecolor="#cccccc", linewidth=0.8)
