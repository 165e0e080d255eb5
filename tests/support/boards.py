"""Boards in front of cameras of our own making: projected by OpenCV, or photographed ray by ray in NumPy.

Neither uses a line of perception/calibration/lens.py, which it is there to try.
"""

import functools

import cv2
import numpy as np

from perception.calibration.board import Board, board_picture, corner_points
from perception.calibration.camera_file import CameraFile, LensRecord
from perception.calibration.lens import Lens
from perception.calibration.sighting import Sighting

BOARD = Board()
LENS = Lens(
    width_px=1280, height_px=720, fx_px=918.0, fy_px=921.0, cx_px=652.3, cy_px=351.8,
    k1=-0.11, k2=0.06, p1=0.0011, p2=-0.0007,
)  # fmt: skip
LESSER_LENS = Lens(
    width_px=640, height_px=480, fx_px=560.0, fy_px=562.0, cx_px=322.1, cy_px=236.7,
    k1=-0.09, k2=0.03, p1=0.0006, p2=0.0009,
)  # fmt: skip
PX_PER_M = 3000.0
MARGIN_M = 0.02


def matrices(lens):
    matrix = np.array([[lens.fx_px, 0, lens.cx_px], [0, lens.fy_px, lens.cy_px], [0, 0, 1]])
    return matrix, np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])


def turned(vector, position):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = cv2.Rodrigues(np.asarray(vector, dtype=float))[0], position
    return T


def shown_at(board, lens, pixel, depth_m, tilt, spin=0.0):
    """T_co of a board whose middle is seen at a pixel, tilted about its two axes and spun about its normal."""
    matrix, d = matrices(lens)
    x, y = cv2.undistortPoints(np.array([[pixel]], dtype=float), matrix, d)[0, 0]
    middle = np.array([board.n_columns, board.n_rows, 0]) * board.square_m / 2
    R = cv2.Rodrigues(np.array([tilt[0], tilt[1], 0.0]))[0] @ cv2.Rodrigues(np.array([0.0, 0.0, spin]))[0]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.array([x, y, 1.0]) * depth_m - R @ middle
    return T


def good_views(lens, n=16, seed=0, board=BOARD, tilt=0.55):
    """Poses all over the picture, near and far, tilted both ways; some hang over its edge."""
    rng = np.random.default_rng(seed)
    poses = []
    for i in range(n):
        column, row = i % 4, (i // 4) % 3
        share = np.array([0.16 + 0.226 * column, 0.2 + 0.3 * row]) + rng.uniform(-0.04, 0.04, 2)
        depth = rng.uniform(0.75, 1.25) * 0.26 * lens.fx_px / (lens.width_px / 2)
        pixel = share * (lens.width_px, lens.height_px)
        poses.append(shown_at(board, lens, pixel, depth, rng.uniform(-tilt, tilt, 2), rng.uniform(-0.5, 0.5)))
    return poses


def projected(lens, T_co, *, noise_px=0.0, rng=None, image="view", board=BOARD, stretch=1.0, blur_px=0.6):
    """What a perfect detector sees, with noise; a board printed by `stretch` too large where asked."""
    matrix, d = matrices(lens)
    points = corner_points(board) * stretch
    pixels = cv2.projectPoints(points, cv2.Rodrigues(T_co[:3, :3])[0], T_co[:3, 3], matrix, d)[0].reshape(-1, 2)
    if noise_px:
        pixels = pixels + rng.normal(0.0, noise_px, pixels.shape)
    inside = (pixels >= 0).all(axis=1) & (pixels <= (lens.width_px - 1, lens.height_px - 1)).all(axis=1)
    return Sighting(
        image=image, width_px=lens.width_px, height_px=lens.height_px, blur_px=blur_px,
        corners=tuple(int(i) for i in np.flatnonzero(inside)),
        pixels=tuple((float(x), float(y)) for x, y in pixels[inside]),
    )  # fmt: skip


@functools.cache
def fine_rays(lens, n_sub):
    """Directions of n_sub² rays a pixel, by OpenCV's own undistortion."""
    matrix, d = matrices(lens)
    u, v = np.meshgrid(np.arange(lens.width_px * n_sub), np.arange(lens.height_px * n_sub))
    pixels = (np.stack([u, v], axis=2).reshape(-1, 1, 2) + 0.5) / n_sub - 0.5
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 8, 1e-7)
    rays = cv2.undistortPoints(pixels, matrix, d, criteria=criteria)
    return rays.reshape(*u.shape, 2).astype(np.float32)


def photograph(lens, T_co, *, blur_px=0.0, smear_px=0, noise=0.0, rng=None, board=BOARD, n_sub=2):
    """A picture of a board on grey: n_sub² rays a pixel, then blur, smear along the rows, noise.  (h, w, 3) uint8"""
    sheet = board_picture(board, px_per_m=PX_PER_M, margin_m=MARGIN_M).astype(np.float32)
    homography = np.linalg.inv(np.column_stack([T_co[:3, 0], T_co[:3, 1], T_co[:3, 3]])).astype(np.float32)
    rays = fine_rays(lens, n_sub)
    x, y, w = (homography[i, 0] * rays[..., 0] + homography[i, 1] * rays[..., 1] + homography[i, 2] for i in range(3))
    ahead = w > 0
    scale = np.where(ahead, w, 1.0)
    map_x = np.where(ahead, (x / scale + MARGIN_M) * PX_PER_M - 0.5, -1e4).astype(np.float32)
    map_y = np.where(ahead, (y / scale + MARGIN_M) * PX_PER_M - 0.5, -1e4).astype(np.float32)
    fine = cv2.remap(sheet, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=120.0)
    grey = 20.0 + 0.8 * cv2.resize(fine, (lens.width_px, lens.height_px), interpolation=cv2.INTER_AREA)
    if blur_px:
        grey = cv2.GaussianBlur(grey, (0, 0), blur_px)
    if smear_px:
        grey = cv2.blur(grey, (smear_px, 1))
    if noise:
        grey = grey + rng.normal(0.0, noise, grey.shape)
    return np.repeat(np.clip(np.round(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def known_camera(lens=LENS, board=BOARD):
    """A camera's file with a lens that is exactly right."""
    record = LensRecord(date="2026-01-01", rms_px=0.1, focal_sd_px=0.5, centre_sd_px=0.5, views=())
    return CameraFile(name="side", serial="1234", board=board, lens=lens, intrinsics=record)
