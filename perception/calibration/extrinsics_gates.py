"""Which views and poses are good enough to say where a camera stands. Pure sums; every limit has its reason here."""

from perception.calibration.board import Board
from perception.calibration.camera_file import CameraFile, ExtrinsicsRecord
from perception.calibration.faults import Fault, Reason
from perception.calibration.gates import MOST_BLUR_PX, is_usable
from perception.calibration.hand_eye import axes_deg
from perception.calibration.lens import Array
from perception.calibration.sighting import Sighting
from perception.calibration.touched import SCALE_TOLERANCE

__all__ = [
    "MOST_CARRIED_RMS_PX", "MOST_RMS_PX", "check_motion", "check_record", "check_scale", "check_seen", "check_sizes",
]  # fmt: skip

MOST_RMS_PX = 1.0
MOST_CARRIED_RMS_PX = 3.0
"""More than on the table: the arm's own 1 to 2 mm are in every view."""
MOST_EXPECTED_MM = 2.0
LEAST_CARRIED = 8
LEAST_AXES_DEG = 10.0
"""Turn between views about the second axis, rms: about one axis alone nothing tells where along it the camera is."""


def check_seen(camera: CameraFile, seen: list[Sighting]) -> list[Fault]:
    """Return whether any picture shows the board sharply, at the size of the lens."""
    usable = [s for s in seen if is_usable(camera.board, s)]
    if usable:
        return check_sizes(camera, usable)
    shown = "; ".join(f"{s.image}: {len(s.corners)} corners, blur {s.blur_px:.1f} px" for s in seen)
    detail = f"expected a sharp view of the board (blur up to {MOST_BLUR_PX:g} px), came {shown}"
    return [Fault(reason=Reason.TOO_FEW, detail=detail)]


def check_sizes(camera: CameraFile, seen: list[Sighting]) -> list[Fault]:
    """Return whether pictures have the size that the lens was calibrated with."""
    size = (camera.lens.width_px, camera.lens.height_px)
    other = [s for s in seen if (s.width_px, s.height_px) != size]
    if not other:
        return []
    detail = (
        f"expected pictures of {size[0]} × {size[1]} as the lens was calibrated with, {other[0].image} has "
        f"{other[0].width_px} × {other[0].height_px}"
    )
    return [Fault(reason=Reason.SIZES, detail=detail)]


def check_motion(T_bt: list[Array], n_named: int) -> list[Fault]:
    """Return whether a carried board was seen often enough, and turned about two axes."""
    if len(T_bt) < LEAST_CARRIED:
        detail = f"expected {LEAST_CARRIED} sharp views of the carried board, came {len(T_bt)} of {n_named} pictures"
        return [Fault(reason=Reason.TOO_FEW, detail=detail)]
    most, second, _ = axes_deg(T_bt)
    if second >= LEAST_AXES_DEG:
        return []
    detail = (
        f"expected the tool turned about two axes by {LEAST_AXES_DEG:g} degrees rms or more between views, came "
        f"{most:.0f} and {second:.1f}: tilt the hand to and fro as well as left and right"
    )
    return [Fault(reason=Reason.MOTION, detail=detail)]


def check_scale(board: Board, scale: float) -> list[Fault]:
    """Return whether the arm and the board agree on lengths."""
    if abs(scale - 1.0) <= SCALE_TOLERANCE:
        return []
    detail = (
        f"the arm carried the board {100 * (scale - 1.0):+.1f} % farther than the board's file says: its squares "
        f"measure {1e3 * board.square_m * scale:.2f} mm, not {1e3 * board.square_m:g}"
    )
    return [Fault(reason=Reason.SQUARE_SIZE, detail=detail)]


def check_record(record: ExtrinsicsRecord, most_rms_px: float) -> list[Fault]:
    """Return whether a pose explains its views, and how well it tells points of the table."""
    faults = []
    if not record.rms_px <= most_rms_px:
        worst = max(record.views, key=lambda view: view.rms_px)
        detail = (
            f"expected corners within {most_rms_px:g} px rms, came {record.rms_px:.2f}, worst {worst.image} with "
            f"{worst.rms_px:.2f}: was board or camera moved in between, is a pose or a touch written down wrongly?"
        )
        faults.append(Fault(reason=Reason.RESIDUAL, detail=detail))
    if not record.expected_mm <= MOST_EXPECTED_MM:
        detail = (
            f"expected a point of the table within {MOST_EXPECTED_MM:g} mm by what these corners tell, came "
            f"{record.expected_mm:.1f}: more boards, spread over the table, an oblique view"
        )
        faults.append(Fault(reason=Reason.UNCERTAIN, detail=detail))
    return faults
