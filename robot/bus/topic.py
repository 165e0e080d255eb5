"""What a topic is: one row of the table that all processes share."""

from enum import StrEnum
from typing import Generic, TypeVar

import msgspec

from robot.bus.errors import BusConfigError

__all__ = ["NAME", "ROOT", "Congestion", "Keep", "Priority", "Query", "Role", "Topic", "key_of"]

T = TypeVar("T", bound=msgspec.Struct)
Q = TypeVar("Q", bound=msgspec.Struct)
R = TypeVar("R", bound=msgspec.Struct)

ROOT = "autotelic"
NAME = r"[a-z][a-z0-9_]{0,15}"
"""Names of roles and sources, as a pattern."""


class Role(StrEnum):
    """What a process is for; it decides which topics the process may write."""

    ROBOT = "robot"
    PERCEPTION = "perception"
    CAMERA = "camera"
    LEARNING = "learning"
    TELEOP = "teleop"
    TWIN = "twin"
    RECORDER = "recorder"
    VIEWER = "viewer"
    """Looks and writes nothing."""


class Priority(StrEnum):
    """Who goes first where messages wait for one link, most urgent first."""

    REAL_TIME = "real_time"
    INTERACTIVE_HIGH = "interactive_high"
    DATA_HIGH = "data_high"
    DATA = "data"
    BACKGROUND = "background"


class Congestion(StrEnum):
    """What becomes of a message that the link has no room for."""

    DROP = "drop"
    """It is lost, and counted by who misses it."""
    BLOCK = "block"
    """Who writes waits."""


class Keep(StrEnum):
    """Which messages a reader is handed."""

    NEWEST = "newest"
    """Only those newer than all before: the others tell of a world that is gone."""
    ALL = "all"
    """Those that were overtaken too; none twice."""


class Topic(msgspec.Struct, Generic[T], frozen=True, kw_only=True):
    """Messages of one type under one key below the plant's."""

    name: str
    kind: type[T]
    """The Struct that is sent. One with a field of bytes carries these as they are, all else in JSON."""
    writers: tuple[Role, ...]
    rate_hz: float | None = None
    """How often it is written; None on change."""
    deadline_s: float | None = None
    """Older than this when it is read is too old; None never is."""
    priority: Priority = Priority.DATA
    congestion: Congestion = Congestion.DROP
    is_express: bool = True
    """It does not wait for others to be sent with it."""
    is_shared_memory: bool = False
    """On one machine it goes through shared memory; pays off from some ten thousand bytes."""
    is_recorded: bool = True
    keep: Keep = Keep.NEWEST


class Query(msgspec.Struct, Generic[Q, R], frozen=True, kw_only=True):
    """A question to one process, and its answer."""

    name: str
    request: type[Q]
    reply: type[R]
    answered_by: tuple[Role, ...]
    asked_by: tuple[Role, ...]
    answer_s: float
    """Who asks waits this long."""


def key_of(serial: str, name: str) -> str:
    """Return the key of a topic of one plant.

    Raises:
        BusConfigError: the serial is empty or would be read as several keys, or as a pattern.
    """
    if not serial or set(serial) & set("/*$?# "):
        raise BusConfigError(f"bus: expected the plant's serial, without / * $ ? # and blanks, got {serial!r}")
    return f"{ROOT}/{serial}/{name}"
