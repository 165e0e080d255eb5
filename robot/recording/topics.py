"""The topics of a session: those of the bus, and what is recorded besides."""

from typing import Any

import msgspec

from robot.bus.topic import Role, Topic
from robot.bus.topics import ARM_STATE, CAMERA_IMAGE, PERCEPT, REQUESTED, SENT, TRUTH, VERDICT
from robot.recording.lanes import Lane
from robot.recording.messages import (
    Asked,
    EpisodeMark,
    EpochOutcome,
    Event,
    GoalChosen,
    Kept,
    ResetMark,
    StationMark,
    StepMark,
    SubgoalChosen,
    TrialEvidence,
)
from robot.viewer_messages import FrameTransforms, SceneUpdate

__all__ = [
    "EPISODE", "EPOCH", "EVENT", "EVIDENCE", "GOAL", "INTENT", "KEPT", "LANES", "RECORDED", "RESET_MARK", "SCENE",
    "STATION", "STEP", "SUBGOAL", "TF", "as_on_the_bus",
]  # fmt: skip

_ANY = tuple(Role)
STATION = Topic(name="station/spec", kind=StationMark, writers=_ANY)
RESET_MARK = Topic(name="station/reset", kind=ResetMark, writers=_ANY)
INTENT = Topic(name="intent", kind=Asked, writers=(Role.LEARNING, Role.TELEOP), rate_hz=20.0)
STEP = Topic(name="station/step", kind=StepMark, writers=_ANY, rate_hz=20.0)
GOAL = Topic(name="decision/goal", kind=GoalChosen, writers=(Role.LEARNING,))
SUBGOAL = Topic(name="decision/subgoal", kind=SubgoalChosen, writers=(Role.LEARNING,))
EVIDENCE = Topic(name="decision/evidence", kind=TrialEvidence, writers=(Role.LEARNING,))
EPOCH = Topic(name="decision/epoch", kind=EpochOutcome, writers=(Role.LEARNING,))
KEPT = Topic(name="learner/state", kind=Kept, writers=(Role.LEARNING,))
EPISODE = Topic(name="episode", kind=EpisodeMark, writers=(Role.TELEOP,))
EVENT = Topic(name="event", kind=Event, writers=_ANY)
TF = Topic(name="tf", kind=FrameTransforms, writers=_ANY, rate_hz=20.0)
SCENE = Topic(name="scene", kind=SceneUpdate, writers=_ANY)

RECORDED: tuple[Topic[Any], ...] = (
    ARM_STATE, REQUESTED, SENT, VERDICT, TRUTH, PERCEPT, STATION, RESET_MARK, INTENT, STEP, GOAL, SUBGOAL, EVIDENCE,
    EPOCH, KEPT, EVENT, TF, SCENE, CAMERA_IMAGE, EPISODE,
)  # fmt: skip
LANES = (
    {topic.name: Lane.TICKS for topic in (ARM_STATE, REQUESTED, SENT, VERDICT, TRUTH)}
    | {topic.name: Lane.VIEW for topic in (TF, SCENE)}
    | {CAMERA_IMAGE.name: Lane.FRAMES}
)


def as_on_the_bus(topic: Topic[Any], *, is_told: bool = False) -> Topic[Any]:
    """Return the topic that a message of the bus is recorded as: `bus/NAME` where sessions mean something else by it.

    Args:
        topic: of the bus.
        is_told: a learner's account, with the percepts that it learns from, goes into the same file.
    """
    own = {recorded.name: recorded.kind for recorded in RECORDED}
    is_other = own.get(topic.name, topic.kind) is not topic.kind or (is_told and topic.name == PERCEPT.name)
    return msgspec.structs.replace(topic, name=f"bus/{topic.name}") if is_other else topic
