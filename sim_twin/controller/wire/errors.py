"""What a peer on a wire can do wrong."""

from robot.errors import WireError

__all__ = ["MalformedError"]


class MalformedError(WireError, ValueError):
    """A peer sent bytes that its protocol does not allow; the server drops that peer and goes on."""
