"""Sources of frames behind one door (robot.hal.protocols.Camera)."""

from perception.cameras.device import DeviceCamera
from perception.cameras.folder import FolderCamera
from perception.cameras.video import VideoCamera

__all__ = ["DeviceCamera", "FolderCamera", "VideoCamera"]
