"""A lens from views of a board: gates before and after, the fit itself by OpenCV."""

import numpy as np

from perception.calibration.board import Board
from perception.calibration.camera_file import LensRecord, ViewRecord
from perception.calibration.faults import refuse
from perception.calibration.gates import check_coverage, check_fit, check_turns, check_views, is_usable
from perception.calibration.lens import Array, Lens
from perception.calibration.poses import rotation
from perception.calibration.sighting import Sighting, pixels_of, points_of
from perception.opencv import opencv

__all__ = ["fit_lens"]


def fit_lens(board: Board, sightings: list[Sighting], *, date: str, with_k3: bool = False) -> tuple[Lens, LensRecord]:
    """Return the lens that explains the views best, and how well.

    Args:
        board: What is printed.
        sightings: What was found of it in each picture.
        date: Today, as 2026-05-31.
        with_k3: Let the third radial coefficient free: for lenses wider than about 90 degrees.

    Raises:
        CalibrationRefusedError: the views are not good enough; all reasons at once.
    """
    usable = [s for s in sightings if is_usable(board, s)]
    faults = check_views(board, sightings)
    if faults:  # what is covered by pictures that cannot be used says nothing
        refuse(faults)
    refuse(check_coverage(usable))
    return _fitted(board, usable, date, with_k3=with_k3)


def _fitted(board: Board, views: list[Sighting], date: str, *, with_k3: bool) -> tuple[Lens, LensRecord]:
    cv2 = opencv()
    size = (views[0].width_px, views[0].height_px)
    rms, matrix, bent, turns, _, sd, _, per_view = cv2.calibrateCameraExtended(
        [points_of(board, s).astype(np.float32) for s in views],
        [pixels_of(s).astype(np.float32) for s in views],
        size,
        None,
        None,
        flags=0 if with_k3 else cv2.CALIB_FIX_K3,
    )
    k1, k2, p1, p2, k3 = np.ravel(bent)[:5].tolist()
    fx, fy, cx, cy = float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])
    sd_fx, sd_fy, sd_cx, sd_cy = np.ravel(sd)[:4].tolist()
    view_rms = np.ravel(per_view).tolist()
    focal_sd = max(sd_fx, sd_fy)
    normals = np.array([_normal(np.ravel(turn)) for turn in turns])
    images = [s.image for s in views]
    refuse([*check_turns(normals), *check_fit(images, view_rms, float(rms), focal_sd / min(fx, fy))])
    lens = Lens(
        width_px=size[0], height_px=size[1], fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, k1=k1, k2=k2, p1=p1, p2=p2, k3=k3
    )
    record = LensRecord(
        date=date,
        rms_px=float(rms),
        focal_sd_px=focal_sd,
        centre_sd_px=max(sd_cx, sd_cy),
        views=tuple(
            ViewRecord(image=s.image, n_corners=len(s.corners), rms_px=r, blur_px=s.blur_px)
            for s, r in zip(views, view_rms, strict=True)
        ),
    )
    return lens, record


def _normal(turn: Array) -> Array:
    """Return the board's normal in the camera's frame.  (3,) -> (3,)"""
    return rotation(turn)[:, 2]
