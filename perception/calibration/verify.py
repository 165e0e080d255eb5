"""The touch test: what was touched, against where the camera sees it on the plane of the touch. Pure sums."""

import numpy as np

from perception.calibration.camera_file import CameraFile, Verification
from perception.calibration.evidence import Touches
from perception.calibration.faults import Fault, Reason, refuse
from perception.calibration.gates import is_usable
from perception.calibration.lens import intersect_height, rays
from perception.calibration.poses import matrix_of
from perception.calibration.sighting import Sighting
from perception.errors import PerceptionConfigError

__all__ = ["MOST_MEAN_MM", "MOST_P95_MM", "plane_errors_mm", "verify"]

MOST_MEAN_MM, MOST_P95_MM = 2.0, 4.0
LEAST_POINTS = 4
LEAST_APART_M = 0.02
"""A point nearer than this to one of the fit says nothing new."""


def verify(camera: CameraFile, touches: Touches, seen: list[Sighting], *, date: str) -> Verification:
    """Return how far touched corners are from where the camera sees them, along the table.

    Each corner's ray meets the plane at the touched height: no pose of the board, no fit.

    Raises:
        PerceptionConfigError: the camera has no pose yet.
        CalibrationRefusedError: too few points, or points that the pose was fitted to.
    """
    if camera.extrinsics is None:
        raise PerceptionConfigError(f"camera {camera.name}: expected a pose, run `calibrate extrinsics` first")
    usable = [s for s in seen if is_usable(camera.board, s)]
    errors = plane_errors_mm(camera, touches, usable)
    refuse(_check_apart(camera, touches))
    if len(errors) < LEAST_POINTS:
        detail = f"expected {LEAST_POINTS} touched corners that a sharp picture shows, came {len(errors)}"
        refuse([Fault(reason=Reason.TOO_FEW, detail=detail)])
    if not np.isfinite(errors).all():
        detail = "a touched corner is seen above the horizon: is this the camera's own pose?"
        refuse([Fault(reason=Reason.RESIDUAL, detail=detail)])
    return Verification(
        date=date,
        n_points=len(errors),
        mean_mm=float(np.mean(errors)),
        p95_mm=float(np.percentile(errors, 95)),
        max_mm=max(errors),
    )


def plane_errors_mm(camera: CameraFile, touches: Touches, seen: list[Sighting]) -> list[float]:
    """Return the error of each touched corner in each picture that shows it; infinite where its ray meets no table."""
    assert camera.extrinsics is not None
    T_bc = matrix_of(camera.extrinsics.pose)
    by_image = {s.image: dict(zip(s.corners, s.pixels, strict=True)) for s in seen}
    errors = []
    for placement in touches.placements:
        for image in placement.images:
            pixel_by_corner = by_image.get(image, {})
            for touch in placement.touches:
                if touch.corner not in pixel_by_corner:
                    continue
                directions = rays(camera.lens, np.array([pixel_by_corner[touch.corner]]))
                found = intersect_height(T_bc, directions, touch.position_m[2])[0, :2]
                error = 1e3 * float(np.linalg.norm(found - touch.position_m[:2]))
                errors.append(error if np.isfinite(error) else float("inf"))
    return errors


def _check_apart(camera: CameraFile, touches: Touches) -> list[Fault]:
    """Return whether points lie where the fit had some."""
    assert camera.extrinsics is not None
    fitted = np.array(camera.extrinsics.points_m).reshape(-1, 3)
    near = [
        touch.position_m
        for placement in touches.placements
        for touch in placement.touches
        if len(fitted) and np.linalg.norm(fitted - touch.position_m, axis=1).min() < LEAST_APART_M
    ]
    if not near:
        return []
    detail = (
        f"{len(near)} points lie within {1e3 * LEAST_APART_M:g} mm of ones that the pose was fitted to, such as "
        f"{', '.join(f'{v:.3f}' for v in near[0])}: move the board and touch it there"
    )
    return [Fault(reason=Reason.IN_THE_FIT, detail=detail)]
