"""Errors of the perception room, in families by who must act."""

from robot.errors import RobotConfigError, RobotError, WireError

__all__ = ["CalibrationRefusedError", "CameraSilentError", "OpenCvMissingError", "PerceptionConfigError"]


class PerceptionConfigError(RobotConfigError):
    """A file, a folder or an argument is wrong: fix it and start again."""


class OpenCvMissingError(PerceptionConfigError):
    """OpenCV is not installed."""


class CalibrationRefusedError(RobotError):
    """What was gathered is not good enough to calibrate by: gather again, as the message says."""


class CameraSilentError(WireError):
    """A camera gives no picture any more, or none that shows anything: look after it."""
