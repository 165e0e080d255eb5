"""A printed board before the studio's camera: held up all over the picture for its lens, then lying on the table."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from robot.frames import CameraSpec, Frame
from robot.photographs import BoardPhotograph, PrintedBoard
from sim_twin.board_stage import Sheet, board_stage
from sim_twin.lens import TrueLens
from sim_twin.rendered_camera import Optics, RenderedCamera
from sim_twin.studio.viewing import View

__all__ = ["photograph_boards"]

Array = NDArray[np.float64]
N_COLUMNS, N_ROWS = 4, 3
WIDE_M, TILT_RAD, SPIN_RAD = 0.5856, 0.55, 0.5
"""The sheet is held where so much fills the picture's width, whatever the lens."""
TOUCH_SD_M = 0.0003
"""Of a tip at a corner, each way."""
LYING = ((0.33, -0.20, 0.3), (0.33, 0.20, -0.4), (0.58, 0.0, 1.4))
"""Middle and turn of the sheet on the table."""
OPTICS = Optics(read_noise=1.5, shot_noise=0.02, defocus_px=0.3)
SEED = 910_001
PERIOD_NS = 40_000_000


def photograph_boards(board: PrintedBoard, spec: CameraSpec, view: View) -> Iterator[BoardPhotograph]:
    """Give pictures for the lens, then pictures of the board at touched places of the table."""
    T_bc = view.T_bc
    picture = np.frombuffer(board.pixels, np.uint8).reshape(board.height_px, board.width_px)
    model = board_stage([Sheet(picture=picture, size_m=board.size_m, T_bs=np.eye(4))])
    rng = np.random.default_rng(SEED)
    camera = RenderedCamera(
        model=model, data=mujoco.MjData(model), spec=spec, lens=view.lens, T_bc=T_bc, optics=OPTICS, rng=rng
    )
    camera.connect()
    try:
        for number, T_cs in enumerate(_held_up(board, view.lens, rng)):
            yield BoardPhotograph(frame=_shot(model, camera, T_bc @ T_cs, number), touches_m=())
        for number, (x, y, turn) in enumerate(LYING, N_COLUMNS * N_ROWS):
            T_bs = _lying(board, x, y, turn)
            corners = np.array([[u, v, 0.0] for _, u, v in board.corners])
            touched = corners @ T_bs[:3, :3].T + T_bs[:3, 3] + rng.normal(0.0, TOUCH_SD_M, corners.shape)
            yield BoardPhotograph(
                frame=_shot(model, camera, T_bs, number),
                touches_m=tuple(
                    (n, (float(p[0]), float(p[1]), float(p[2])))
                    for (n, _, _), p in zip(board.corners, touched, strict=True)
                ),
            )
    finally:
        camera.close()


def _shot(model: mujoco.MjModel, camera: RenderedCamera, T_bs: Array, number: int) -> Frame:
    """Put the sheet somewhere and take its picture."""
    body = model.body("sheet_0")
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(T_bs[:3, :3]).ravel())
    body.pos[:], body.quat[:] = T_bs[:3, 3], quat
    frame = camera.read(number * PERIOD_NS)
    assert frame is not None
    return frame


def _held_up(board: PrintedBoard, lens: TrueLens, rng: np.random.Generator) -> Iterator[Array]:
    """Give poses of the sheet in the camera's frame: all over the picture, tilted both ways, spun about.  (4, 4)"""
    middle = np.array([*board.size_m, 0.0]) / 2.0
    depth_m = WIDE_M * lens.focal_px[0] / lens.width_px
    for i in range(N_COLUMNS * N_ROWS):
        share = np.array([0.15 + 0.7 * (i % N_COLUMNS) / (N_COLUMNS - 1), 0.2 + 0.6 * (i // N_COLUMNS) / (N_ROWS - 1)])
        pixel = (share + rng.uniform(-0.03, 0.03, 2)) * (lens.width_px, lens.height_px)
        way = (pixel - lens.centre_px) / lens.focal_px
        a, b = rng.uniform(-TILT_RAD, TILT_RAD, 2)
        T = np.eye(4)
        T[:3, :3] = _about_x(a) @ _about_y(b) @ _about_z(float(rng.uniform(-SPIN_RAD, SPIN_RAD)))
        T[:3, 3] = np.array([*way, 1.0]) * depth_m * float(rng.uniform(0.9, 1.3)) - T[:3, :3] @ middle
        yield T


def _lying(board: PrintedBoard, x: float, y: float, turn: float) -> Array:
    """Return T_bs of a sheet face up on the table, its z into it."""
    T = np.eye(4)
    T[:3, :3] = _about_z(turn) @ np.diag([1.0, -1.0, -1.0])
    T[:3, 3] = np.array([x, y, 0.0005]) - T[:3, :3] @ np.array([*board.size_m, 0.0]) / 2.0
    return T


def _about_x(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _about_y(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
