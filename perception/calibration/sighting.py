"""A board seen in a picture: which corners, where, how sharp. The edge to OpenCV's detector."""

import numpy as np
from numpy.typing import NDArray

from config.values import Section
from perception.calibration.board import Board, corner_points, grid_of
from perception.calibration.lens import Array
from perception.calibration.sharpness import blur_px, edges_of_corners, edges_of_quads
from perception.opencv import opencv
from robot.frames import Picture

__all__ = ["Finder", "Sighting", "pixels_of", "points_of"]

WINDOW = 0.11
"""Half a corner's window, as a share of the shortest square side at it."""
LEAST_SIDE_PX = 16.0


class Sighting(Section, frozen=True, kw_only=True):
    """One picture's corners."""

    image: str
    """The picture's name, for a person."""
    width_px: int
    height_px: int
    corners: tuple[int, ...]
    """Numbers of the corners that were found."""
    pixels: tuple[tuple[float, float], ...]
    """Where, in the same order."""
    blur_px: float
    """Standard deviation of the blur across the board's edges; infinite where it cannot be told."""


class Finder:
    """Finds one board in pictures."""

    def __init__(self, board: Board) -> None:
        cv2 = opencv()
        self._board = board
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))
        size = (board.n_columns, board.n_rows)
        printed = cv2.aruco.CharucoBoard(size, board.square_m, board.marker_m, dictionary)
        self._detector = cv2.aruco.CharucoDetector(printed)
        self._spots = cv2.aruco.ArucoDetector(dictionary)

    def find(self, picture: Picture, image: str) -> Sighting:
        """Return what is seen of the board; no corners where nothing is.

        Where blur leaves no marker that can be read, the blur of whatever has four corners is told.
        """
        cv2 = opencv()
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        pixels, numbers, _, _ = self._detector.detectBoard(grey)
        corners = () if numbers is None else tuple(int(n) for n in np.ravel(numbers))
        places = np.zeros((0, 2)) if pixels is None else np.reshape(pixels, (-1, 2)).astype(np.float64)
        by_corner = self._refined(grey, dict(zip(corners, places, strict=True)))
        edges = edges_of_corners(self._board, by_corner)
        blur = blur_px(grey, edges if len(edges) else edges_of_quads(self._quads(grey)))
        height, width = grey.shape
        return Sighting(
            image=image,
            width_px=width,
            height_px=height,
            corners=tuple(by_corner),
            pixels=tuple((float(x), float(y)) for x, y in by_corner.values()),
            blur_px=blur,
        )

    def _refined(self, grey: NDArray[np.uint8], by_corner: dict[int, Array]) -> dict[int, Array]:
        """Return corners found anew, each within a window that holds no marker: they begin at an eighth of a square.

        The detector takes one window for all; with small or slanted squares its corners were up to 1.2 px off.
        Corners without a neighbour, or of squares too small in the picture, are left out.
        """
        cv2 = opencv()
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-3)
        refined: dict[int, Array] = {}
        for corner, place in by_corner.items():
            beside = [by_corner[n] for n in self._beside(corner) if n in by_corner]
            side = min((float(np.linalg.norm(other - place)) for other in beside), default=0.0)
            if side < LEAST_SIDE_PX:
                continue
            reach = min(max(round(side * WINDOW), 2), 10)
            start = place.astype(np.float32).reshape(1, 1, 2)
            found = cv2.cornerSubPix(grey, start, (reach, reach), (-1, -1), stop)
            refined[corner] = np.reshape(found, 2).astype(np.float64)
        return refined

    def _beside(self, corner: int) -> list[int]:
        """Return the numbers of the corners around one."""
        n = self._board.n_columns - 1
        column, _ = grid_of(self._board, corner)
        return [corner - n, corner + n, *([corner - 1] if column else []), *([corner + 1] if column + 1 < n else [])]

    def _quads(self, grey: NDArray[np.uint8]) -> Array:
        found, _, others = self._spots.detectMarkers(grey)
        return np.reshape([*found, *others], (-1, 4, 2)).astype(np.float64)


def points_of(board: Board, sighting: Sighting) -> Array:
    """Return the corners that were found as points of the board.  -> (n, 3) m"""
    return corner_points(board)[list(sighting.corners)]


def pixels_of(sighting: Sighting) -> Array:
    """Return where they were found.  -> (n, 2) px"""
    return np.array(sighting.pixels, dtype=np.float64).reshape(-1, 2)
