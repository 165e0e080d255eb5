"""A camera's file made of photographed boards by the product's own calibration."""

from collections.abc import Iterable

from config.scenario import Scenario
from perception.calibration.board import Board, board_picture, corner_points
from perception.calibration.camera_file import CameraFile
from perception.calibration.evidence import Placement, Touch, Touches
from perception.calibration.extrinsics import fit_table
from perception.calibration.intrinsics import fit_lens
from perception.calibration.plane_error import grid_on_table
from perception.calibration.sighting import Finder
from robot.frames import picture_of
from robot.photographs import BoardPhotograph, PrintedBoard

__all__ = ["calibrated", "printed"]

PX_PER_M, MARGIN_M = 4000.0, 0.02


def printed(board: Board) -> PrintedBoard:
    """Return a board's sheet and the four corners at its ends, for whoever photographs it."""
    picture = board_picture(board, px_per_m=PX_PER_M, margin_m=MARGIN_M)
    points, across, down = corner_points(board), board.n_columns - 1, board.n_rows - 1
    ends = (0, across - 1, across * (down - 1), across * down - 1)
    return PrintedBoard(
        pixels=picture.tobytes(), width_px=picture.shape[1], height_px=picture.shape[0],
        size_m=(board.n_columns * board.square_m + 2 * MARGIN_M, board.n_rows * board.square_m + 2 * MARGIN_M),
        corners=tuple((n, float(points[n, 0]) + MARGIN_M, float(points[n, 1]) + MARGIN_M) for n in ends),
    )  # fmt: skip


def calibrated(board: Board, photographs: Iterable[BoardPhotograph], scenario: Scenario, *, date: str) -> CameraFile:
    """Return the file of the camera that took them.

    Raises:
        CalibrationRefusedError: they are not good enough; the reasons.
    """
    finder, held, lying, placements = Finder(board), [], [], []
    name, serial = "", ""
    for number, photograph in enumerate(photographs):
        image = f"{number:02}"
        name = photograph.frame.camera
        sighting = finder.find(picture_of(photograph.frame), image)
        if photograph.touches_m:
            touches = tuple(Touch(corner=n, position_m=at) for n, at in photograph.touches_m)
            placements.append(Placement(images=(image,), touches=touches))
            lying.append(sighting)
        else:
            held.append(sighting)
    lens, record = fit_lens(board, held, date=date)
    camera = CameraFile(name=name, serial=serial, board=board, lens=lens, intrinsics=record)
    table = scenario.table
    (x, y), (half_x, half_y) = table.centre_m, (table.size_m[0] / 2, table.size_m[1] / 2)
    area = grid_on_table((x - half_x, y - half_y), (x + half_x, y + half_y), table.height_m)
    extrinsics = fit_table(camera, Touches(placements=tuple(placements)), lying, area, date=date)
    return CameraFile(name=name, serial=serial, board=board, lens=lens, intrinsics=record, extrinsics=extrinsics)
