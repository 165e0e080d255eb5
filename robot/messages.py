"""What crosses the doors: measurement, percept, intent, command, verdict.

Every message is a frozen, keyword-only Struct of plain values. Lengths are metres, angles radians, times nanoseconds
of the arm's clock; positions and forces are in the arm's base frame, which is also the world frame of the twin.
Quaternions are scalar first (w, x, y, z).
"""

from enum import StrEnum

import msgspec

from robot.as_came import AsCame

__all__ = [
    "ArmCommand",
    "ArmMode",
    "ArmSpec",
    "ArmState",
    "Box3",
    "Executed",
    "Grip",
    "GripCommand",
    "GripState",
    "Heading",
    "Hold",
    "Intent",
    "JointTarget",
    "Limited",
    "ObjectPercept",
    "ObjectPose",
    "Outcome",
    "Percept",
    "PlantIdentity",
    "PlantKind",
    "Quat",
    "SceneState",
    "StationMode",
    "StationSpec",
    "StationState",
    "StepResult",
    "Twist",
    "Vec3",
    "Vec6",
    "Verdict",
]

Vec3 = tuple[float, float, float]
Vec6 = tuple[float, float, float, float, float, float]
Quat = tuple[float, float, float, float]
Box3 = tuple[Vec3, Vec3]


class Message(msgspec.Struct, frozen=True):
    """Base of everything that crosses a door."""


# --------------------------------------------------------------------------------------------------- measurement


class ArmMode(StrEnum):
    """What the arm's own controller says of itself."""

    IDLE = "idle"
    RUNNING = "running"
    STOPPED = "stopped"
    PROTECTIVE_STOP = "protective_stop"
    SAFEGUARD_STOP = "safeguard_stop"
    SAFETY_FAULT = "safety_fault"
    EMERGENCY_STOP = "emergency_stop"


class GripState(Message, frozen=True, kw_only=True):
    """What the hand measured."""

    opening_m: float
    """Distance between the pads."""
    is_moving: bool
    has_object: bool
    """Closing ended on something before the jaws met (the hand's object-detected flag)."""


class ArmState(Message, frozen=True, kw_only=True):
    """What the arm measured at one instant, base frame, joints base to wrist 3."""

    stamp_ns: int
    q_rad: Vec6
    qd_rad_s: Vec6
    tcp_position_m: Vec3
    tcp_quat: Quat
    tcp_speed_m_s: Vec3
    """As the arm's own controller tells it, by its own model: not worked out from the joints here."""
    tcp_force_n: Vec3
    """Force of the world on the tool, tool weight removed."""
    grip: GripState
    digital_in: int
    """Bit i is input i."""
    digital_out: int
    """Bit i is output i, as read back."""
    mode: ArmMode


class ObjectPose(Message, frozen=True, kw_only=True):
    """Where one thing is."""

    name: str
    position_m: Vec3
    quat: Quat


class SceneState(Message, frozen=True, kw_only=True):
    """Ground truth of a simulated world: poses of everything the scenario names, in its order."""

    stamp_ns: int
    objects: tuple[ObjectPose, ...]


# ------------------------------------------------------------------------------------------------------- percept


class ObjectPercept(Message, frozen=True, kw_only=True):
    """One object as perceived."""

    name: str
    position_m: Vec3
    quat: Quat
    age_s: float
    is_valid: bool
    """False where it is not known where the thing is now: the place is where it was seen last, if it was."""
    confidence: float = 1.0
    """0 to 1."""


class Percept(Message, frozen=True, kw_only=True):
    """The paper's P(t) = (d_1..d_n, s_1..s_m), plus what goals are judged on."""

    stamp_ns: int
    distances_m: tuple[float, ...]
    """d_j: Euclidean distance from the tool centre point to the j-th distance entry of the scenario."""
    button_states: tuple[float, ...]
    """s_i: 1.0 where button i's lamp is lit, else 0.0."""
    ages_s: tuple[float, ...]
    """Age of each entry of P(t), distances first."""
    valid: tuple[bool, ...]
    """Validity of each entry of P(t), distances first."""
    confidences: tuple[float, ...] = ()
    """0 to 1 for each entry of P(t), distances first; empty where all are sure."""
    objects: tuple[ObjectPercept, ...]
    tcp_position_m: Vec3
    grip: GripState
    is_in_contact: bool
    """The tool is held up by something (force-guarded descent has stopped it)."""


# -------------------------------------------------------------------------------------------------------- intent


class Grip(StrEnum):
    """What a person or a policy may ask of the hand."""

    OPEN = "open"
    CLOSE = "close"


class Heading(Message, tag="heading", frozen=True, kw_only=True):
    """The paper's action: direction of movement and height of the arm."""

    heading_rad: float
    """Direction in the table plane, from base x towards base y."""
    distance_m: float
    """How far along it in one time step; 0 moves in height only."""
    height_m: float
    """Height above the table that the tool centre point should go to."""
    grip: Grip | None = None


class Twist(Message, tag="twist", frozen=True, kw_only=True):
    """A velocity of the tool centre point in the base frame, for as long as the step lasts."""

    linear_m_s: Vec3
    angular_rad_s: Vec3 = (0.0, 0.0, 0.0)
    grip: Grip | None = None


class JointTarget(Message, tag="joint_target", frozen=True, kw_only=True):
    """Joint angles to go to."""

    q_rad: Vec6
    grip: Grip | None = None


class Hold(Message, tag="hold", frozen=True, kw_only=True):
    """Come to rest and stay."""

    grip: Grip | None = None


Intent = Heading | Twist | JointTarget | Hold


# --------------------------------------------------------------------------------------------- command and verdict


class GripCommand(Message, frozen=True, kw_only=True):
    """What is asked of the hand."""

    opening_m: float
    force_n: float
    speed_m_s: float


class ArmCommand(Message, frozen=True, kw_only=True):
    """What is asked of the plant for one tick."""

    stamp_ns: int
    sequence: int
    q_rad: Vec6
    grip: GripCommand
    digital_out: int


class Outcome(StrEnum):
    """What safety did with a command."""

    PASSED = "passed"
    LIMITED = "limited"
    REFUSED = "refused"


class Verdict(Message, frozen=True, kw_only=True):
    """What safety said, by which rule and by how much."""

    stamp_ns: int
    sequence: int
    outcome: Outcome
    reason: str = ""
    """Name of the limiter or check, empty when nothing was changed."""
    detail: str = ""
    """What was expected and what came, for a person."""
    amount: float = 0.0
    """By how much, in the rule's own unit."""
    is_latched: bool = False
    refused: AsCame | None = None
    """The command or the intent that was refused, as it came; None where the reason lay elsewhere."""


class Limited(Message, frozen=True, kw_only=True):
    """What changed a step on its way to a command, and by how much."""

    name: str
    amount: float
    """Greatest in the step: metres where the target was moved, radians for joint_range, else a share of the step."""


class Executed(Message, frozen=True, kw_only=True):
    """What was really carried out of an intent."""

    duration_s: float
    moved_m: Vec3
    """Displacement of the measured tool centre point during the step."""
    target_m: Vec3
    """Where the tool centre point will come to rest if nothing more is asked (the shaped target)."""
    limiters: tuple[str, ...] = ()
    """What shortened or changed the intent (leash, guard, workspace, ...)."""
    limited: tuple[Limited, ...] = ()
    """The same, each with by how much."""
    unseen: tuple[str, ...] = ()
    """Things that are not perceived now: the arm kept clear of where they were last, or of wherever they may be."""
    requested: Intent | AsCame | None = None
    """What was asked for: the intent itself where the gate admitted it, else whatever came."""
    sent: ArmCommand | None = None
    """The last command that passed the gate and was sent; None where none has been since command was taken."""


# --------------------------------------------------------------------------------------------------- plant, station


class PlantKind(StrEnum):
    """What stands behind the interface."""

    REAL = "real"
    VIRTUAL = "virtual"
    TWIN = "twin"
    FAKE = "fake"


class PlantIdentity(Message, frozen=True, kw_only=True):
    """Which world this is; must match what the rig names before anything is armed."""

    kind: PlantKind
    model: str
    serial: str


class ArmSpec(Message, frozen=True, kw_only=True):
    """What can be known of an arm before connecting to it."""

    model: str
    rate_hz: float
    """Command rate: one tick is 1 / rate_hz."""
    n_inputs: int
    n_outputs: int
    q_min_rad: Vec6
    q_max_rad: Vec6
    qd_max_rad_s: Vec6
    grip_stroke_m: float


class StationMode(StrEnum):
    """Where a station is on the way to motion."""

    DISARMED = "disarmed"
    ARMED = "armed"
    ENGAGED = "engaged"
    LATCHED = "latched"


class StationState(Message, frozen=True, kw_only=True):
    """A station's mode and, when latched or disarmed by an event, why."""

    mode: StationMode
    reason: str = ""
    source: str = ""
    """Who it is, or was last, armed for: the holder of its lease."""
    profile: str = ""
    """The limits that it is, or was last, armed with."""


class StationSpec(Message, frozen=True, kw_only=True):
    """What a learner may know before the first step. It names no goal, rule or scenario."""

    n_distances: int
    n_buttons: int
    distance_names: tuple[str, ...]
    """What each d_j is measured to, as named in Percept.objects; `table` is the table top.

    For geometric prediction only.
    """
    step_s: float
    max_step_m: float
    heights_m: tuple[float, float]
    """Lowest and travel height that a Heading may ask for, above the table."""
    workspace_m: Box3
    """Corners of the box that the tool centre point may be in, base frame."""
    table_height_m: float = 0.0


class StepResult(Message, frozen=True, kw_only=True):
    """What one time step came to."""

    percept: Percept
    executed: Executed
    verdicts: tuple[Verdict, ...]
    """Verdicts that were not a plain pass, oldest first."""
    is_void: bool = False
    """The step was cut short by a stop, stale data, a fault or a person: evidence about nothing."""
