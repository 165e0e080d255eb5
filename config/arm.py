"""An arm and its tool: kinematics, masses, limits, servo. One file per arm type in config/arms."""

from typing import Annotated

from msgspec import Meta

from config.fitted import FittedPlant
from config.values import Angle, Length, Mass, Name, NonNegative, Point, Positive, Section, Span

__all__ = ["ArmConfig", "Capsule", "Joint", "MotionLimits", "Servo", "Tool"]


PadSize = Annotated[float, Meta(ge=0.005, le=0.1)]


class Joint(Section, frozen=True, kw_only=True):
    """One row of the Denavit-Hartenberg table (standard convention, as UR publishes it) and its limits."""

    name: Name
    a_m: Length
    d_m: Length
    alpha_rad: Angle
    mass_kg: Mass
    com_m: Point
    """Centre of mass in the link's DH frame."""
    range_rad: tuple[Angle, Angle]
    speed_rad_s: Annotated[float, Meta(gt=0.0, le=10.0)]
    acceleration_rad_s2: Annotated[float, Meta(gt=0.0, le=100.0)]
    jerk_rad_s3: Annotated[float, Meta(gt=0.0, le=10_000.0)]
    torque_nm: Annotated[float, Meta(gt=0.0, le=1000.0)]


class Capsule(Section, frozen=True, kw_only=True):
    """A collision capsule in a link's DH frame. Link 0 is the base, link i moves with joint i."""

    link: Annotated[int, Meta(ge=0, le=6)]
    from_m: Point
    to_m: Point
    radius_m: Span


class Servo(Section, frozen=True, kw_only=True):
    """UR's servoj smoothing. Lag follows robot.servo.lag_s of these two and the dead time."""

    lookahead_s: Annotated[float, Meta(ge=0.03, le=0.2)]
    gain: Annotated[float, Meta(ge=100.0, le=2000.0)]
    dead_time_s: Annotated[float, Meta(ge=0.0, le=0.05)]


class Tool(Section, frozen=True, kw_only=True):
    """A parallel-jaw gripper on the flange, approach axis +z of the flange, jaws along its y axis."""

    name: Name
    mass_kg: Mass
    com_m: Point
    tcp_m: Point
    """Tool centre point in the flange frame: between the pads."""
    stroke_m: Annotated[float, Meta(gt=0.0, le=0.3)]
    force_n: tuple[Positive, Positive]
    """Least and greatest grip force."""
    grip_force_n: Positive
    """Force used when closing."""
    speed_m_s: tuple[Positive, Positive]
    pad_size_m: tuple[PadSize, PadSize, PadSize]
    """Full size of a pad: along the jaws, across, along the approach axis."""
    finger_depth_m: Span
    """Free finger length above the tool centre point before the palm begins."""
    tip_below_tcp_m: Span
    """How far the fingertips reach past the tool centre point."""


class MotionLimits(Section, frozen=True, kw_only=True):
    """How a Heading becomes motion, and the basic limits that the gate holds."""

    step_s: Annotated[float, Meta(ge=0.01, le=1.0)] = 0.05
    max_step_m: Annotated[float, Meta(gt=0.0, le=0.1)] = 0.022
    leash_m: Span = 0.09
    """How far the target may run ahead of where a free tool is by now, or, where the measured tool is clearly somewhere
    else, of that one."""
    guard_height_m: Span = 0.18
    """Below this height over the table the tool moves at guarded speed."""
    guarded_speed_m_s: Annotated[float, Meta(gt=0.0, le=0.5)] = 0.25
    speed_m_s: Annotated[float, Meta(gt=0.0, le=2.0)] = 0.5
    """Greatest speed of the tool along any axis."""
    acceleration_m_s2: Annotated[float, Meta(gt=0.0, le=20.0)] = 3.0
    jerk_m_s3: Annotated[float, Meta(gt=0.0, le=2000.0)] = 100.0
    contact_force_n: Positive = 15.0
    """Force on the tool at which a descent is stopped and reported as contact."""
    hard_force_n: Positive = 90.0
    """Force on the tool from which commands give way at once, as hard as they must; up to it they do so by the joints'
    own accelerations."""
    heights_m: tuple[Span, Span] = (0.025, 0.225)
    """Lowest and travel height of the tool centre point over the table."""
    workspace_m: tuple[Point, Point]
    """Corners of the box that the tool centre point may be in, base frame."""
    table_clearance_m: NonNegative = 0.004
    """The fingertips may not be commanded lower than this over the table."""
    intent_max_age_s: Positive = 0.1
    state_max_age_s: Positive = 0.05
    percept_max_age_s: Positive = 0.15
    """A time step that begins with an older percept comes to rest."""
    tracking_error_rad: Positive = 0.25
    force_limit_n: Positive = 250.0
    """Measured force on the tool that the gate refuses when it lasts longer than one tick."""
    impact_limit_n: Positive = 700.0
    """Measured force on the tool that the gate refuses at once; in a blow motion needs one tick to give way."""


class ArmConfig(Section, frozen=True, kw_only=True):
    """One arm with its tool."""

    name: Name
    joints: tuple[Joint, Joint, Joint, Joint, Joint, Joint]
    capsules: tuple[Capsule, ...]
    servo: Servo
    tool: Tool
    motion: MotionLimits
    home_rad: tuple[Angle, Angle, Angle, Angle, Angle, Angle]
    """A tool-down pose over the table, used to seed inverse kinematics."""
    tool_yaw_rad: Angle = 0.0
    """Turn of the tool about the vertical while working with Heading intents."""
    fitted: FittedPlant | None = None
    """How this very arm differs from that, by sessions of it (`autotelic twin fit`): for the twin's physics alone."""
