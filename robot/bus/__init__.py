"""What links the processes: Zenoh sessions on explicit endpoints, and the few topics that there are so far."""

from robot.bus.session import BusError, open_session
from robot.bus.topics import RESET, TRUTH, ResetRequest, topic

__all__ = ["RESET", "TRUTH", "BusError", "ResetRequest", "open_session", "topic"]
