"""What a camera's pixels mean: its lens, where it stands, and how well both are known."""

from perception.calibration.camera_file import CameraFile, load_camera
from perception.calibration.lens import Lens, intersect_height, project, rays
from perception.calibration.poses import Pose

__all__ = ["CameraFile", "Lens", "Pose", "intersect_height", "load_camera", "project", "rays"]
