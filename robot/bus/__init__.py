"""What links the processes: Zenoh sessions on explicit endpoints, and the few topics that there are so far."""

from robot.bus.session import BusError, open_session
from robot.bus.topics import CELL, RESET, TRUTH, CellAction, CellTruth, ResetRequest, topic

__all__ = ["CELL", "RESET", "TRUTH", "BusError", "CellAction", "CellTruth", "ResetRequest", "open_session", "topic"]
