"""Errors of the robot package, in families by who must act."""

__all__ = [
    "ArmRefusedError",
    "BugError",
    "NotEngagedError",
    "RobotConfigError",
    "RobotError",
    "SafetyError",
    "StaleStateError",
    "WireError",
]


class RobotError(Exception):
    """Root of everything this package raises on purpose."""


class RobotConfigError(RobotError, ValueError):
    """A file or an argument is wrong: fix it and start again."""


class WireError(RobotError, ConnectionError):
    """A wire or a process is absent: retry or replug."""


class StaleStateError(WireError, TimeoutError):
    """The plant's newest state is older than its deadline."""


class SafetyError(RobotError):
    """Safety refused or latched: a person must look."""


class NotEngagedError(SafetyError):
    """Motion was asked for while the station was not engaged."""


class ArmRefusedError(SafetyError, WireError):
    """The arm's controller did not do what it was told, or is not in a state to be told."""


class BugError(RobotError, AssertionError):
    """An invariant of this program does not hold."""
