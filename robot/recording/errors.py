"""Errors of sessions, by who must act."""

from robot.errors import RobotConfigError, RobotError

__all__ = ["DamagedError", "SessionError", "UnfitError"]


class SessionError(RobotError):
    """Something about a recorded session is not as it must be."""


class DamagedError(SessionError, ValueError):
    """A file is torn or was changed: `autotelic session recover` saves what is whole in it."""


class UnfitError(SessionError, RobotConfigError):
    """A session is whole, but not one for what was asked: name another one, or another rig."""
