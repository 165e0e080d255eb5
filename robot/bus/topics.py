"""The one table of topics. Keys are below the serial of the plant that they are about.

Rates and deadlines are starting points. Two rows have one key for many writers, told apart by the source in each
envelope: `health` of every process, and `intent`, of which a robot node takes only what comes under the lease in force.
"""

from typing import Any

import msgspec

from robot.bus.account_rows import AccountPart, AccountWritten
from robot.bus.camera_rows import Forget, Forgotten, FrameNote, Light, TwinPose
from robot.bus.station_rows import Beat, Command, Health, StationAsk, StationReport, StationTold, StepDone, StopAsk
from robot.bus.tick_rows import TickBatch
from robot.bus.topic import Keep, Priority, Query, Role, Topic
from robot.messages import ArmCommand, ArmState, Percept, SceneState, Verdict
from robot.viewer_messages import CompressedImage

__all__ = [
    "ACCOUNT", "ARM_STATE", "ASK", "BEAT", "CAMERA_FRAME", "CAMERA_IMAGE", "CELL", "FORGET", "HEALTH", "INTENT",
    "LAY_OUT", "LIGHT", "PERCEPT", "PING", "QUERIES", "REPORT", "REQUESTED", "RESET", "SENT", "STEP", "STOP", "TICKS",
    "TOPICS", "TRUTH", "TWIN_POSE", "VERDICT", "WRITTEN", "CellAction", "CellTruth", "Ping", "Pong", "ResetDone",
    "ResetRequest",
]  # fmt: skip


class CellAction(msgspec.Struct, frozen=True, kw_only=True):
    """Let a finger press a button of the twin's table, or a thing lie in a box with a sensor; or let go again."""

    name: str = ""
    """Of the button or the box; empty only looks."""
    is_on: bool = False


class CellTruth(msgspec.Struct, frozen=True, kw_only=True):
    """What somebody in front of the twin's table sees."""

    lamps: dict[str, bool]
    """Lit or not, by the button's name."""
    lids: dict[str, float]
    """How far open, from 0 to 1, by the box's name."""


class ResetRequest(msgspec.Struct, frozen=True, kw_only=True):
    """Lay the table out."""

    seed: int
    epoch: int
    digital_out: int


class ResetDone(msgspec.Struct, frozen=True, kw_only=True):
    """The table is laid out."""

    seed: int
    epoch: int


class Ping(msgspec.Struct, frozen=True, kw_only=True):
    """Is anybody there?"""


class Pong(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody is."""

    source: str
    role: Role
    clock: int
    """Processes with the same number have the same monotonic clock: they run on one machine."""
    now_ns: int
    """Of that clock, when it answered."""


COMMANDERS = (Role.LEARNING, Role.TELEOP)

ARM_STATE = Topic(
    name="arm/state", kind=ArmState, writers=(Role.ROBOT,), rate_hz=50.0, deadline_s=0.06, priority=Priority.REAL_TIME
)
REQUESTED = Topic(
    name="command/requested", kind=ArmCommand, writers=(Role.ROBOT,), rate_hz=50.0, deadline_s=0.06,
    priority=Priority.DATA_HIGH,
)  # fmt: skip
SENT = Topic(
    name="command/sent", kind=ArmCommand, writers=(Role.ROBOT,), rate_hz=50.0, deadline_s=0.06,
    priority=Priority.DATA_HIGH,
)  # fmt: skip
VERDICT = Topic(
    name="verdict", kind=Verdict, writers=(Role.ROBOT,), rate_hz=50.0, deadline_s=0.06, priority=Priority.DATA_HIGH
)
TICKS = Topic(name="arm/ticks", kind=TickBatch, writers=(Role.ROBOT,), rate_hz=20.0, keep=Keep.ALL)
"""Every tick, some at a time, for who records: as measurement, command and verdict it is written then."""
TRUTH = Topic(
    name="twin/truth", kind=SceneState, writers=(Role.TWIN,), rate_hz=100.0, deadline_s=0.1, priority=Priority.DATA_HIGH
)
TWIN_POSE = Topic(
    name="twin/pose", kind=TwinPose, writers=(Role.TWIN,), rate_hz=50.0, deadline_s=0.1, priority=Priority.DATA_HIGH,
    is_recorded=False,
)  # fmt: skip
"""Simulation only: what a camera process draws."""
CAMERA_FRAME = Topic(
    name="camera/frame", kind=FrameNote, writers=(Role.CAMERA,), rate_hz=20.0, deadline_s=0.15,
    priority=Priority.DATA_HIGH, is_recorded=False,
)  # fmt: skip
"""One key for all cameras, told apart by the source and the note. The pictures themselves lie in shared memory."""
CAMERA_IMAGE = Topic(name="camera/image", kind=CompressedImage, writers=(Role.CAMERA,), rate_hz=20.0, keep=Keep.ALL)
"""The same frames, compressed, for who records; whoever perceives takes them from shared memory."""
LIGHT = Topic(name="camera/light", kind=Light, writers=(Role.PERCEPTION,), rate_hz=2.0)
PERCEPT = Topic(
    name="percept", kind=Percept, writers=(Role.PERCEPTION, Role.ROBOT), rate_hz=50.0, deadline_s=0.15,
    priority=Priority.INTERACTIVE_HIGH,
)  # fmt: skip
"""Written by the perception node; by the robot node at the end of each time step, where that perceives by itself."""
INTENT = Topic(
    name="intent", kind=Command, writers=COMMANDERS, rate_hz=20.0, deadline_s=0.1, priority=Priority.REAL_TIME,
)  # fmt: skip
STEP = Topic(name="station/step", kind=StepDone, writers=(Role.ROBOT,), rate_hz=20.0, priority=Priority.REAL_TIME)
BEAT = Topic(
    name="lease", kind=Beat, writers=COMMANDERS, rate_hz=5.0, deadline_s=0.5, priority=Priority.INTERACTIVE_HIGH,
    is_recorded=False,
)  # fmt: skip
STOP = Topic(name="stop", kind=StopAsk, writers=tuple(Role), priority=Priority.REAL_TIME, keep=Keep.ALL)
"""Anybody's, whatever else he may not write."""
REPORT = Topic(
    name="station/state", kind=StationReport, writers=(Role.ROBOT,), rate_hz=10.0, deadline_s=0.5,
    priority=Priority.INTERACTIVE_HIGH,
)  # fmt: skip
HEALTH = Topic(
    name="health", kind=Health, writers=tuple(Role), rate_hz=2.0, deadline_s=1.0, priority=Priority.DATA,
)  # fmt: skip
ACCOUNT = Topic(name="account", kind=AccountPart, writers=(Role.LEARNING,), keep=Keep.ALL, is_recorded=False)
"""What a learner perceived, decided and learnt, part by part. Not recorded as it is: its parts are, under their own
names, in their order and without a gap."""
WRITTEN = Topic(
    name="account/written", kind=AccountWritten, writers=(Role.RECORDER,), rate_hz=4.0, is_recorded=False
)  # fmt: skip

RESET = Query(
    name="station/reset", request=ResetRequest, reply=ResetDone, answered_by=(Role.TWIN,),
    asked_by=(Role.ROBOT, Role.LEARNING, Role.TELEOP), answer_s=20.0,
)  # fmt: skip
"""Answered when the table is laid out, or by an error in words."""
CELL = Query(
    name="twin/cell",
    request=CellAction,
    reply=CellTruth,
    answered_by=(Role.TWIN,),
    asked_by=(Role.ROBOT,),
    answer_s=5.0,
)
FORGET = Query(
    name="percept/forget", request=Forget, reply=Forgotten, answered_by=(Role.PERCEPTION,), asked_by=(Role.ROBOT,),
    answer_s=1.0,
)  # fmt: skip
ASK = Query(
    name="station/ask", request=StationAsk, reply=StationTold, answered_by=(Role.ROBOT,), asked_by=COMMANDERS,
    answer_s=40.0,
)  # fmt: skip
"""Leases and arming. Taking command of an arm takes some seconds."""
LAY_OUT = Query(
    name="station/lay_out", request=StationAsk, reply=StationTold, answered_by=(Role.ROBOT,), asked_by=COMMANDERS,
    answer_s=60.0,
)  # fmt: skip
"""The same, for what lays the table out."""
PING = Query(name="bus/ping", request=Ping, reply=Pong, answered_by=tuple(Role), asked_by=tuple(Role), answer_s=1.0)
"""Answered by every process on the bus."""

TOPICS: tuple[Topic[Any], ...] = (
    ARM_STATE, REQUESTED, SENT, VERDICT, TRUTH, TWIN_POSE, CAMERA_FRAME, LIGHT, PERCEPT, INTENT, STEP, BEAT, STOP,
    REPORT, HEALTH, ACCOUNT, WRITTEN, TICKS, CAMERA_IMAGE,
)  # fmt: skip
QUERIES: tuple[Query[Any, Any], ...] = (RESET, CELL, FORGET, ASK, LAY_OUT, PING)
