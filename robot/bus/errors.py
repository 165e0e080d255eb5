"""What can be wrong with the bus, or with what comes over it."""

from robot.errors import RobotConfigError, WireError

__all__ = ["BusConfigError", "BusError", "MalformedError", "NoHubError", "SchemaError"]


class BusError(WireError):
    """The bus cannot be opened or does not answer."""


class NoHubError(BusError):
    """Nobody listens where the hub should: nothing else of the rig runs there."""


class BusConfigError(RobotConfigError):
    """The bus was asked for what it does not do: an endpoint off loopback, a topic that is another role's to write."""


class MalformedError(BusError, ValueError):
    """What came is no message of ours."""


class SchemaError(BusError):
    """What came was written with another version of its type."""
