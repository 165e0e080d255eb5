"""What crosses the bus between a robot node, which holds an arm, and whoever commands it, watches it or stops it."""

import msgspec

from robot.as_came import AsCame
from robot.messages import ArmState, Intent, Percept, PlantIdentity, StationSpec, StationState, StepResult

__all__ = [
    "Arm", "ArmableWork", "Beat", "ClearLatch", "Command", "Describe", "Engage", "Failed", "HandOver", "Health",
    "LayOut", "Release", "ResetPlant", "StationAsk", "StationCard", "StationReport", "StationTold", "StepDone",
    "StopAsk", "TakeLease", "Work",
]  # fmt: skip


class Command(msgspec.Struct, frozen=True, kw_only=True):
    """One time step that is asked for under a lease."""

    lease: str
    """Drawn by the robot node when it gave the lease; nobody guesses it, and no other lease has it."""
    number: int
    """Greater than that of all that was asked under this lease before: a captured message is an old one."""
    intent: Intent | AsCame
    """What is no intent crosses as it came: it is the gate that refuses it."""
    duration_s: float | None = None


class Beat(msgspec.Struct, frozen=True, kw_only=True):
    """Who has the lease is still there."""

    lease: str


class StopAsk(msgspec.Struct, frozen=True, kw_only=True):
    """Stop the arm. It is written again and again until a report confirms its number."""

    number: int
    by: str
    is_final: bool = False
    """Nothing is armed any more after it, by this robot node: whoever started it is ending it."""


class StationReport(msgspec.Struct, frozen=True, kw_only=True):
    """How the station of a robot node is."""

    revision: int
    """Greater than that of every report before, of this robot node."""
    begun: int
    """Another number for a robot node that was started anew."""
    state: StationState
    holder: int = 0
    """Number of the lease in force; 0 where there is none."""
    n_latches: int = 0
    latch_reasons: tuple[str, ...] = ()
    """The newest, oldest first."""
    stops: tuple[int, ...] = ()
    """Numbers of stops that were carried out, the newest last."""
    n_refused: int = 0
    """Commands that were not let in: old, late, or under another lease."""
    refused: str = ""
    """Why the last of them was not."""


class Failed(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked for was not done: an error of the robot package, by its class's name."""

    kind: str
    message: str


class StepDone(msgspec.Struct, frozen=True, kw_only=True):
    """What a time step came to, or why there was none."""

    lease: str
    number: int
    report: StationReport
    result: StepResult | None = None
    measured: ArmState | None = None
    failed: Failed | None = None


class StationCard(msgspec.Struct, frozen=True, kw_only=True):
    """What may be known of a station before anything moves."""

    spec: StationSpec
    identity: PlantIdentity
    scenario: str
    profile: str
    model_sha256: str | None = None


class Describe(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """What station is this?"""


class TakeLease(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Give the lease to a source."""

    source: str
    life_s: float
    """Without a beat for so long it ends."""
    is_driven: bool = False
    """A person drives: the hand does what it is asked, and nothing by itself."""


class HandOver(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Let go of the lease so that a source may take it; what was armed is disarmed."""

    to: str


class Release(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Let go of the lease: the arm is stopped, and disarmed."""


class Arm(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Go from disarmed to armed."""

    by: str


class Engage(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Go from armed to engaged."""


class ResetPlant(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Lay the table out in any mode."""

    seed: int
    epoch: int


class ClearLatch(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Go from latched to armed."""

    by: str


class LayOut(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Begin an epoch."""

    seed: int
    epoch: int


ArmableWork = Arm | Engage | ResetPlant | ClearLatch | LayOut | HandOver | Release
"""What only the holder of the lease may ask for."""
Work = Describe | TakeLease | ArmableWork


class StationAsk(msgspec.Struct, frozen=True, kw_only=True):
    """Something to be done that is no time step."""

    work: Work
    lease: str = ""
    number: int = 0
    """As that of a Command, and counted with them."""


class StationTold(msgspec.Struct, frozen=True, kw_only=True):
    """What came of it."""

    report: StationReport
    card: StationCard | None = None
    lease: str = ""
    """The one that was given."""
    is_pending: bool = False
    """A person at the arm is waited for: it is asked for again, under the same number, until it is done."""
    percept: Percept | None = None
    measured: ArmState | None = None
    failed: Failed | None = None


class Health(msgspec.Struct, frozen=True, kw_only=True):
    """How a process is."""

    pid: int
    clock: int
    """Which monotonic clock it goes by."""
    now_ns: int
    """Of that clock."""
    rate_hz: float
    """Rounds of its loop since the last message."""
    target_hz: float | None = None
    """What they should be; None where it goes round when there is something to do."""
    late_ms: float = 0.0
    """The longest that a round came after its time, since the last message."""
    queue: int = 0
    """Things that wait to be done."""
    rss_mb: float = 0.0
    """Memory that it holds."""
    n_errors: int = 0
    """Since it began."""
    last_error: str = ""
    doing: str = ""
    """In words."""
    is_leaving: bool = False
    """It leaves the bus now, and its silence from now on means nothing."""
