"""What links the processes: one table of topics, typed ways to write and read them, Zenoh underneath."""

from robot.bus.errors import BusConfigError, BusError, MalformedError, SchemaError
from robot.bus.inlet import Counts, Received
from robot.bus.ports import Publisher, Subscriber
from robot.bus.queries import Answerer, Asked, Asker
from robot.bus.session import Bus
from robot.bus.topic import Query, Role, Topic, key_of
from robot.bus.topics import CELL, QUERIES, RESET, TOPICS, TRUTH, CellAction, CellTruth, ResetDone, ResetRequest

__all__ = [
    "CELL",
    "QUERIES",
    "RESET",
    "TOPICS",
    "TRUTH",
    "Answerer",
    "Asked",
    "Asker",
    "Bus",
    "BusConfigError",
    "BusError",
    "CellAction",
    "CellTruth",
    "Counts",
    "MalformedError",
    "Publisher",
    "Query",
    "Received",
    "ResetDone",
    "ResetRequest",
    "Role",
    "SchemaError",
    "Subscriber",
    "Topic",
    "key_of",
]
