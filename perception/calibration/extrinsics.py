"""Where a camera stands: from boards lying at touched places, or from a board carried by the arm."""

import numpy as np

from config.values import Point
from perception.calibration.board import Board
from perception.calibration.camera_file import CameraFile, ExtrinsicsRecord, ViewRecord
from perception.calibration.evidence import Placement, Poses, Touches
from perception.calibration.extrinsics_gates import (
    MOST_CARRIED_RMS_PX,
    MOST_RMS_PX,
    check_motion,
    check_record,
    check_scale,
    check_seen,
    check_sizes,
)
from perception.calibration.faults import refuse
from perception.calibration.gates import is_usable
from perception.calibration.hand_eye import solve_hand_eye
from perception.calibration.least_squares import Fit, fit_least_squares
from perception.calibration.lens import Array, Lens, project
from perception.calibration.plane_error import expected_plane_error_m, nudged
from perception.calibration.poses import carried, inverse, mean_transform, pose_of, rotation, transform
from perception.calibration.sighting import Sighting, pixels_of, points_of
from perception.calibration.touched import Lying, check_touches, lay
from perception.opencv import opencv

__all__ = ["board_in_camera", "fit_carried", "fit_table"]


def fit_table(
    camera: CameraFile, touches: Touches, seen: list[Sighting], area_b: Array, *, date: str
) -> ExtrinsicsRecord:
    """Return the camera's pose from boards that lay still and were touched.

    Args:
        camera: the camera, its lens and its board.
        touches: what was touched, by board.
        seen: what was found in every picture that they name.
        area_b: points of the table where it will matter.  (n, 3) m
        date: today, as 2026-05-31.

    Raises:
        CalibrationRefusedError: touches or pictures are not good enough; all reasons at once.
    """
    names = [f"board {i}" for i in range(1, len(touches.placements) + 1)]
    faults = [f for p, n in zip(touches.placements, names, strict=True) for f in check_touches(camera.board, p, n)]
    refuse([*faults, *check_seen(camera, seen)])
    lying = [lay(camera.board, placement) for placement in touches.placements]
    pairs = _paired(camera.board, touches.placements, lying, seen)
    starts = [T_bo @ inverse(board_in_camera(camera, sighting)) for T_bo, sighting in pairs]
    points = np.concatenate([carried(T_bo, points_of(camera.board, s)) for T_bo, s in pairs])
    pixels = np.concatenate([pixels_of(s) for _, s in pairs])
    T_start = mean_transform(starts)

    def residuals(step: Array) -> Array:
        seen_at = project(camera.lens, carried(inverse(nudged(T_start, step)), points))
        return np.nan_to_num((seen_at - pixels).ravel(), nan=1e3)

    fit = fit_least_squares(residuals, np.zeros(6))
    record = _record(
        camera.lens, nudged(T_start, fit.x), fit, [s for _, s in pairs], area_b, date=date, method="table",
        points_m=tuple(t.position_m for p in touches.placements for t in p.touches),
        touch_rms_mm=max(board.rms_mm for board in lying),
    )  # fmt: skip
    refuse(check_record(record, MOST_RMS_PX))
    return record


def fit_carried(
    camera: CameraFile, poses: Poses, seen: list[Sighting], area_b: Array, *, date: str
) -> ExtrinsicsRecord:
    """Return the camera's pose from views of a board that the arm held, wherever it sits in the hand.

    Park and Martin's answer, then the sum of squared pixels over camera and board together.

    Args:
        camera: the camera, its lens and its board.
        poses: the tool's pose at each picture.
        seen: what was found in each of those pictures, in their order.
        area_b: points of the table where it will matter.  (n, 3) m
        date: today, as 2026-05-31.

    Raises:
        CalibrationRefusedError: the views are not good enough; all reasons at once.
    """
    by_image = {s.image: s for s in seen if is_usable(camera.board, s)}
    views = [view for view in poses.views if view.image in by_image]
    sightings = [by_image[view.image] for view in views]
    T_bt = [transform(rotation(np.array(v.rotation_vector_rad)), np.array(v.position_m)) for v in views]
    refuse([*check_sizes(camera, sightings), *check_motion(T_bt, len(poses.views))])
    start = solve_hand_eye(T_bt, [board_in_camera(camera, s) for s in sightings])
    refuse(check_scale(camera.board, start.scale))
    points = [points_of(camera.board, s) for s in sightings]
    pixels = np.concatenate([pixels_of(s) for s in sightings])

    def residuals(step: Array) -> Array:
        T_cb, T_to = inverse(nudged(start.T_bc, step[:6])), nudged(start.T_to, step[6:])
        places = np.concatenate([carried(T_cb @ T @ T_to, p) for T, p in zip(T_bt, points, strict=True)])
        return np.nan_to_num((project(camera.lens, places) - pixels).ravel(), nan=1e3)

    fit = fit_least_squares(residuals, np.zeros(12))
    T_bc = nudged(start.T_bc, fit.x[:6])
    record = _record(
        camera.lens, T_bc, fit, sightings, area_b, date=date, method="tool", points_m=(), touch_rms_mm=None
    )
    refuse(check_record(record, MOST_CARRIED_RMS_PX))
    return record


def board_in_camera(camera: CameraFile, sighting: Sighting) -> Array:
    """Return T_co from one view, refined over all its corners.  -> (4, 4)"""
    cv2 = opencv()
    lens = camera.lens
    matrix = np.array([[lens.fx_px, 0.0, lens.cx_px], [0.0, lens.fy_px, lens.cy_px], [0.0, 0.0, 1.0]])
    bent = np.array([lens.k1, lens.k2, lens.p1, lens.p2, lens.k3])
    points, pixels = points_of(camera.board, sighting), pixels_of(sighting)
    _, turns, places, _ = cv2.solvePnPGeneric(points, pixels, matrix, bent, flags=cv2.SOLVEPNP_IPPE)
    fits = [
        _refined(lens, points, pixels, transform(rotation(np.ravel(r)), np.ravel(t)))
        for r, t in zip(turns, places, strict=True)
    ]
    return min(fits, key=lambda found: found[1])[0]


def _refined(lens: Lens, points: Array, pixels: Array, T_co: Array) -> tuple[Array, float]:
    """Return a board's pose brought to the least sum of squared pixels, and that sum."""

    def residuals(step: Array) -> Array:
        return np.nan_to_num((project(lens, carried(nudged(T_co, step), points)) - pixels).ravel(), nan=1e3)

    fit = fit_least_squares(residuals, np.zeros(6))
    return nudged(T_co, fit.x), float(fit.residuals @ fit.residuals)


def _paired(
    board: Board, placements: tuple[Placement, ...], lying: list[Lying], seen: list[Sighting]
) -> list[tuple[Array, Sighting]]:
    """Return each usable picture with where its board lies."""
    by_image = {s.image: s for s in seen if is_usable(board, s)}
    return [
        (lain.T_bo, by_image[image])
        for placement, lain in zip(placements, lying, strict=True)
        for image in placement.images
        if image in by_image
    ]


def _record(
    lens: Lens, T_bc: Array, fit: Fit, seen: list[Sighting], area_b: Array, *, date: str, method: str,
    points_m: tuple[Point, ...], touch_rms_mm: float | None,
) -> ExtrinsicsRecord:  # fmt: skip
    ends = np.cumsum([2 * len(s.corners) for s in seen])[:-1]
    views = tuple(
        ViewRecord(image=s.image, n_corners=len(s.corners), rms_px=_rms_px(part), blur_px=s.blur_px)
        for s, part in zip(seen, np.split(fit.residuals, ends), strict=True)
    )
    return ExtrinsicsRecord(
        date=date,
        method=method,
        pose=pose_of(T_bc),
        rms_px=_rms_px(fit.residuals),
        touch_rms_mm=touch_rms_mm,
        expected_mm=min(1e3 * expected_plane_error_m(lens, T_bc, fit.covariance[:6, :6], area_b), 1e6),
        points_m=points_m,
        views=views,
    )


def _rms_px(residuals: Array) -> float:
    """Return the root of the mean squared distance, two residuals a corner."""
    return float(np.sqrt(2.0 * (residuals @ residuals) / len(residuals)))
