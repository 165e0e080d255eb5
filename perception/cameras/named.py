"""What a rig's file says of its camera, as a camera says it of itself."""

from config.rig import Rig, RigCamera
from perception.calibration.camera_file import load_camera
from perception.errors import PerceptionConfigError
from robot.frames import CameraSpec

__all__ = ["named_camera"]


def named_camera(rig: Rig) -> tuple[RigCamera, CameraSpec]:
    """Return the camera that a rig names, and what it must be: its picture's size is the calibrated one.

    Raises:
        PerceptionConfigError: it names none, or no device.
        ConfigError: the camera's file is missing or wrong.
    """
    camera = rig.camera
    if camera is None or not camera.device:
        raise PerceptionConfigError(
            f"rig {rig.name}: expected `camera:` with a `device`, such as /dev/video0 or ./table.mp4, came none"
        )
    lens = load_camera(camera.calibration).lens
    spec = CameraSpec(
        name=camera.name, serial="", width_px=lens.width_px, height_px=lens.height_px, rate_hz=camera.rate_hz
    )
    return camera, spec
