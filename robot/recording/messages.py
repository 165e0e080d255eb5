"""What a session holds besides what crosses the doors: what was asked, decided, and what became of it.

Goals are indices, as the learner knows them, with their names beside for people.
"""

from enum import StrEnum

import msgspec

from robot.as_came import AsCame
from robot.messages import Executed, Intent, StationSpec, Verdict

__all__ = [
    "Asked", "EpisodeEnd", "EpisodeMark", "EpochOutcome", "Event", "GoalChosen", "Kept", "Purpose", "ResetMark",
    "StationMark", "StepMark", "SubgoalChosen", "TrialEvidence",
]  # fmt: skip


class Purpose(StrEnum):
    """What an epoch is for."""

    LEARN = "learn"
    TEST = "test"
    """Learning off."""
    DRIVE = "drive"
    """A person drives, or a script."""
    WATCH = "watch"
    """Whatever goes over the bus of a rig that runs is listened to."""


class StationMark(msgspec.Struct, frozen=True, kw_only=True):
    """What the station is, once at the beginning."""

    spec: StationSpec
    is_driven: bool
    """The hand does what it is asked, and nothing by itself."""


class ResetMark(msgspec.Struct, frozen=True, kw_only=True):
    """The table is to be laid out; the next percept is the first one of it."""

    seed: int
    epoch: int
    purpose: Purpose


class Asked(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked of the station for one time step."""

    intent: Intent | AsCame
    duration_s: float | None = None
    """None is the station's own time step."""


class StepMark(msgspec.Struct, frozen=True, kw_only=True):
    """What the time step came to; the percept before it on its topic is the step's."""

    executed: Executed
    verdicts: tuple[Verdict, ...]
    is_void: bool


class GoalChosen(msgspec.Struct, frozen=True, kw_only=True):
    """The goal of an epoch."""

    epoch: int
    goal: int
    name: str


class SubgoalChosen(msgspec.Struct, frozen=True, kw_only=True):
    """The sub-goal of a trial."""

    epoch: int
    trial: int
    """Counted from 1 within the epoch."""
    goal: int
    subgoal: int
    name: str


class TrialEvidence(msgspec.Struct, frozen=True, kw_only=True):
    """What a trial showed."""

    epoch: int
    trial: int
    goal: int
    subgoal: int
    outcome: str
    state: tuple[bool, ...]
    """Goals achieved in the epoch before it."""
    state_after: tuple[bool, ...]
    predicted: float
    skill: float
    n_steps: int
    is_explored: bool


class EpochOutcome(msgspec.Struct, frozen=True, kw_only=True):
    """What an epoch came to."""

    epoch: int
    goal: int
    is_achieved: bool
    is_void: bool
    n_trials: int
    n_steps: int


class Kept(msgspec.Struct, frozen=True, kw_only=True):
    """A fingerprint of everything learnt, at an epoch's end: a replay must come to the same."""

    n_done: int
    sha256: str
    heard: str = ""
    """Digest of all percepts and outcomes that were learnt from, byte for byte: more than the learner may notice."""


class EpisodeEnd(StrEnum):
    """What a driver made of an episode."""

    KEPT = "kept"
    REDONE = "redone"
    """It is done again, at the same table; this one is not kept."""
    DISCARDED = "discarded"


class EpisodeMark(msgspec.Struct, frozen=True, kw_only=True):
    """An episode of a drive begins, or ends."""

    number: int
    """Counted from 0."""
    table: int
    """Which table it has; the same one again where it is done again."""
    end: EpisodeEnd | None = None
    """None at its beginning."""


class Event(msgspec.Struct, frozen=True, kw_only=True):
    """Something happened that is no message of its own."""

    what: str
    detail: str = ""
