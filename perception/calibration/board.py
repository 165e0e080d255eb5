"""A ChArUco board: its file, its corners, and what is black on it. Maths, but for the dictionary that OpenCV holds.

Board frame: origin at the outer corner of the first square, x along the row, y to the next row, z into the paper. A
board that lies on a table, seen from above, has z down.
"""

from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from config.values import Section
from perception.calibration.lens import Array
from perception.errors import PerceptionConfigError
from perception.opencv import opencv

__all__ = ["Board", "Box", "black_boxes", "board_picture", "check_board", "corner_points", "grid_of"]

Count = Annotated[int, Meta(ge=3, le=40)]
Side = Annotated[float, Meta(ge=0.002, le=0.5)]
Dictionary = Literal["4X4_50", "4X4_100", "5X5_50", "5X5_100", "6X6_100", "6X6_250"]
Box = tuple[float, float, float, float]
"""Left, upper, right and lower end in metres of the board frame."""
WIDEST_MARKER = 0.9
"""Share of a square; with more no white is left between a marker and the squares beside it."""


class Board(Section, frozen=True, kw_only=True):
    """What is printed. The first square is black; markers stand in the white ones."""

    n_columns: Count = 7
    n_rows: Count = 5
    square_m: Side = 0.036
    marker_m: Side = 0.027
    dictionary: Dictionary = "5X5_100"


def check_board(board: Board) -> None:
    """Refuse a board that cannot be.

    Raises:
        PerceptionConfigError: markers as large as squares, or more of them than the dictionary has.
    """
    if not board.marker_m <= WIDEST_MARKER * board.square_m:
        raise PerceptionConfigError(
            f"expected markers of at most {WIDEST_MARKER:g} of a square, {1e3 * WIDEST_MARKER * board.square_m:g} mm, "
            f"came {1e3 * board.marker_m:g} mm"
        )
    n_markers, n_held = board.n_columns * board.n_rows // 2, int(board.dictionary.split("_")[1])
    if n_markers > n_held:
        raise PerceptionConfigError(
            f"{board.n_columns} × {board.n_rows} squares: expected a dictionary of {n_markers} markers or more, "
            f"{board.dictionary} has {n_held}"
        )


def corner_points(board: Board) -> Array:
    """Return the inner corners of the squares, row by row: the index is the corner's number.  -> (n, 3) m"""
    columns, rows = np.meshgrid(np.arange(1, board.n_columns), np.arange(1, board.n_rows))
    flat = np.stack([columns.ravel(), rows.ravel(), np.zeros(columns.size)], axis=1)
    return (flat * board.square_m).astype(np.float64)


def grid_of(board: Board, corner: int) -> tuple[int, int]:
    """Return column and row of an inner corner, from 0."""
    return corner % (board.n_columns - 1), corner // (board.n_columns - 1)


def black_boxes(board: Board) -> list[Box]:
    """Return all that is black on the board; boxes touch but do not overlap."""
    boxes: list[Box] = []
    number = 0
    for row in range(board.n_rows):
        for column in range(board.n_columns):
            left, upper = column * board.square_m, row * board.square_m
            if (row + column) % 2 == 0:
                boxes.append((left, upper, left + board.square_m, upper + board.square_m))
            else:
                boxes += _marker(board, number, left, upper)
                number += 1
    return boxes


def board_picture(board: Board, *, px_per_m: float, margin_m: float) -> np.ndarray:
    """Return the board as it is printed, with white around it.  -> (height, width) uint8

    A pixel is as dark as the share of it that is covered, so that edges are where they belong to a part of a pixel.
    """
    width_m, height_m = board.n_columns * board.square_m, board.n_rows * board.square_m
    width, height = (round((side + 2.0 * margin_m) * px_per_m) for side in (width_m, height_m))
    ink = np.zeros((height, width))
    for left, upper, right, lower in black_boxes(board):
        across = _covered(left, right, width, px_per_m, margin_m)
        down = _covered(upper, lower, height, px_per_m, margin_m)
        ink += down[:, None] * across[None, :]
    return np.round(255.0 * (1.0 - np.clip(ink, 0.0, 1.0))).astype(np.uint8)


def _covered(begin_m: float, end_m: float, n: int, px_per_m: float, margin_m: float) -> Array:
    """Return which share of each of n pixels in a line lies between two ends.  -> (n,)"""
    first, last = (begin_m + margin_m) * px_per_m, (end_m + margin_m) * px_per_m
    left = np.arange(n)
    return np.clip(np.minimum(last, left + 1) - np.maximum(first, left), 0.0, 1.0)


def _marker(board: Board, number: int, left: float, upper: float) -> list[Box]:
    """Return a marker's black parts in a square: each row's runs of black cells."""
    cv2 = opencv()
    cells = int(board.dictionary.split("X")[0]) + 2
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))
    bits = cv2.aruco.generateImageMarker(dictionary, number, cells, borderBits=1) == 0
    cell = board.marker_m / cells
    x, y = (start + (board.square_m - board.marker_m) / 2.0 for start in (left, upper))
    boxes: list[Box] = []
    for row, line in enumerate(bits):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(int)))
        for begin, end in edges.reshape(-1, 2).tolist():
            boxes.append((x + begin * cell, y + row * cell, x + end * cell, y + (row + 1) * cell))
    return boxes
