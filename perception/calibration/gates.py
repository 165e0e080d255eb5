"""Which set of views is good enough for a lens. Pure sums on sightings; every limit has its reason here."""

import numpy as np

from perception.calibration.board import Board
from perception.calibration.faults import Fault, Reason
from perception.calibration.lens import Array
from perception.calibration.poses import spread_deg
from perception.calibration.sighting import Sighting, pixels_of

__all__ = [
    "AREA_NAMES", "LEAST_VIEWS", "N_AREAS", "check_bar", "check_coverage", "check_fit", "check_turns", "check_views",
    "covered", "is_usable",
]  # fmt: skip

LEAST_VIEWS = 10
"""Each ninth of the picture and one to spare."""
LEAST_SHARE_OF_CORNERS = 0.4
MOST_BLUR_PX = 1.4
"""With little more, markers of squares 25 px wide cannot be read; in focus and at rest it is below 0.9."""
ALIKE_SHARE = 0.03
"""Two views whose common corners moved by less than this share of the picture's width count as one."""
N_AREAS = (3, 3)
AREA_NAMES = (
    "upper left", "upper middle", "upper right", "left", "middle", "right", "lower left", "lower middle", "lower right",
)  # fmt: skip
LEAST_IN_AREA = 8
"""Corners of all views together, in each ninth of the picture."""
LEAST_SPREAD_DEG = 6.0
"""Of the board's normal about its mean, rms, along the lesser of two directions.

Parallel boards leave the focal length open.
"""
MOST_RMS_PX = 0.6
MOST_VIEW_RATIO = 3.0
MOST_SD_SHARE = 0.005
"""Standard deviation of the focal length, as a share of it: 0.3 % is taken up by the camera's pose on a plane."""
BAR_TOLERANCE = 0.004
"""A ruler shows 0.3 mm on 100; 0.4 % are 2 mm on half a metre."""


def is_usable(board: Board, sighting: Sighting) -> bool:
    """Whether a view has corners enough, and sharp ones."""
    return _has_corners(board, sighting) and sighting.blur_px <= MOST_BLUR_PX


def check_bar(board: Board, measured_mm: float, nominal_mm: float) -> list[Fault]:
    """Return what a ruler on the printed bar says against the board's file."""
    share = measured_mm / nominal_mm
    if abs(share - 1.0) <= BAR_TOLERANCE:
        return []
    detail = (
        f"the bar should be {nominal_mm:g} mm long within {100 * BAR_TOLERANCE:g} %, it was measured as "
        f"{measured_mm:g}: print at 100 %, or write what was printed into the board's file, square_m: "
        f"{board.square_m * share:.5f} and marker_m: {board.marker_m * share:.5f}"
    )
    return [Fault(reason=Reason.SQUARE_SIZE, detail=detail)]


def check_views(board: Board, sightings: list[Sighting]) -> list[Fault]:
    """Return what is wrong with the views by themselves: their number, sharpness, likeness and size."""
    faults = []
    sizes = sorted({(s.width_px, s.height_px) for s in sightings})
    if len(sizes) > 1:
        shown = ", ".join(f"{w} × {h}" for w, h in sizes)
        faults.append(Fault(reason=Reason.SIZES, detail=f"expected pictures of one size, came {shown}"))
    seen = [s for s in sightings if _has_corners(board, s)]
    sharp = [s for s in seen if s.blur_px <= MOST_BLUR_PX]
    blurred = [s for s in sightings if MOST_BLUR_PX < s.blur_px < float("inf")]
    apart = _apart(sharp)
    if len(apart) >= LEAST_VIEWS:
        return faults
    need = f"expected {LEAST_VIEWS} sharp views that differ"
    if len(sharp) >= LEAST_VIEWS:
        detail = f"{need}, came {len(apart)} among {len(sharp)}: move and tilt the board between pictures"
        return [*faults, Fault(reason=Reason.ALIKE, detail=detail)]
    if len(sharp) + len(blurred) >= LEAST_VIEWS:
        worst = max(blurred, key=lambda s: s.blur_px)
        detail = (
            f"{need}, {len(blurred)} of {len(sightings)} are blurred by more than {MOST_BLUR_PX:g} px (the spread of "
            f"the grey steps at the squares' edges), worst {worst.image} with {worst.blur_px:.1f}: focus, more light, "
            "hold still"
        )
        return [*faults, Fault(reason=Reason.BLURRED, detail=detail)]
    detail = (
        f"{need}, came {len(apart)}: of {len(sightings)} pictures {len(seen)} show "
        f"{LEAST_SHARE_OF_CORNERS:.0%} of the board's corners or more; is it this board?"
    )
    return [*faults, Fault(reason=Reason.TOO_FEW, detail=detail)]


def covered(sightings: list[Sighting], cells: tuple[int, int]) -> Array:
    """Return how many corners were seen in each cell of the picture.  -> (rows, columns)"""
    counts = np.zeros((cells[1], cells[0]))
    for sighting in sightings:
        share = pixels_of(sighting) / (sighting.width_px, sighting.height_px)
        place = np.clip((share * cells).astype(int), 0, np.array(cells) - 1)
        np.add.at(counts, (place[:, 1], place[:, 0]), 1)
    return counts


def check_coverage(sightings: list[Sighting]) -> list[Fault]:
    """Return which parts of the picture were left out."""
    counts = covered(sightings, N_AREAS).ravel()
    bare = [name for name, n in zip(AREA_NAMES, counts, strict=True) if n < LEAST_IN_AREA]
    if not bare:
        return []
    detail = f"expected {LEAST_IN_AREA} corners in each ninth of the picture, fewer {', '.join(bare)}: go there too"
    return [Fault(reason=Reason.COVERAGE, detail=detail)]


def check_turns(normals: Array) -> list[Fault]:
    """Return whether the board was tilted enough between views, from its normals in the camera's frame.  (n, 3)"""
    _, lesser = spread_deg(normals)
    if lesser >= LEAST_SPREAD_DEG:
        return []
    detail = (
        f"expected the board tilted by {LEAST_SPREAD_DEG:g} degrees rms at least both ways, came {lesser:.1f}: "
        "parallel boards do not tell the focal length; tilt it left and right, to and fro, by 20 to 45 degrees"
    )
    return [Fault(reason=Reason.PLANAR, detail=detail)]


def check_fit(images: list[str], view_rms_px: list[float], rms_px: float, focal_sd_share: float) -> list[Fault]:
    """Return whether a lens explains its views, and how surely its focal length is known."""
    faults = []
    order = sorted(zip(view_rms_px, images, strict=True))
    if not rms_px <= MOST_RMS_PX:
        detail = (
            f"expected corners within {MOST_RMS_PX:g} px of the lens rms, came {rms_px:.2f}, worst {order[-1][1]} with "
            f"{order[-1][0]:.2f}: is the board flat, was the focus locked?"
        )
        faults.append(Fault(reason=Reason.RESIDUAL, detail=detail))
    elif order[-1][0] > MOST_VIEW_RATIO * max(rms_px, 0.1):
        detail = f"{order[-1][1]} is off by {order[-1][0]:.2f} px where all together are by {rms_px:.2f}: leave it out"
        faults.append(Fault(reason=Reason.RESIDUAL, detail=detail))
    if not focal_sd_share <= MOST_SD_SHARE:
        detail = (
            f"expected the focal length within {100 * MOST_SD_SHARE:g} % (standard deviation), came "
            f"{100 * focal_sd_share:.2f} %: more views, tilted more, nearer ones and farther ones"
        )
        faults.append(Fault(reason=Reason.UNCERTAIN, detail=detail))
    return faults


def _has_corners(board: Board, sighting: Sighting) -> bool:
    return len(sighting.corners) >= LEAST_SHARE_OF_CORNERS * (board.n_columns - 1) * (board.n_rows - 1)


def _apart(sightings: list[Sighting]) -> list[Sighting]:
    """Return views of which no two are alike, the first of each kind."""
    chosen: list[Sighting] = []
    for sighting in sightings:
        if not any(_is_alike(sighting, other) for other in chosen):
            chosen.append(sighting)
    return chosen


def _is_alike(a: Sighting, b: Sighting) -> bool:
    place_a, place_b = dict(zip(a.corners, a.pixels, strict=True)), dict(zip(b.corners, b.pixels, strict=True))
    common = sorted(place_a.keys() & place_b.keys())
    if not common:
        return False
    moved = np.linalg.norm(np.array([place_a[n] for n in common]) - [place_b[n] for n in common], axis=1)
    return float(moved.max()) < ALIKE_SHARE * a.width_px
