"""What links the processes: one table of topics, typed ways to write and read them, Zenoh underneath."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from robot.bus.errors import BusConfigError, BusError, MalformedError, SchemaError
from robot.bus.inlet import Counts, Received
from robot.bus.topic import Query, Role, Topic, key_of
from robot.bus.topics import CELL, QUERIES, RESET, TOPICS, TRUTH, CellAction, CellTruth, ResetDone, ResetRequest

if TYPE_CHECKING:
    from robot.bus.ports import Publisher, Subscriber
    from robot.bus.queries import Answerer, Asked, Asker
    from robot.bus.session import Bus

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

_LINKED = {
    "Answerer": "queries", "Asked": "queries", "Asker": "queries", "Bus": "session", "Publisher": "ports",
    "Subscriber": "ports",
}  # fmt: skip
"""What brings Zenoh with it: imported when it is asked for, for a recording needs the table of topics alone."""


def __getattr__(name: str) -> Any:  # noqa: ANN401 - what a module's name is
    if name not in _LINKED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LINKED[name]}"), name)
