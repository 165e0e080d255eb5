"""Sources of frames behind one door (robot.hal.protocols.Camera)."""

from perception.cameras.folder import FolderCamera

__all__ = ["FolderCamera"]
