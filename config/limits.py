"""What one arm with one tool may do, in named profiles. One file per arm and tool in config/limits.

A profile only ever takes away: motion and gate hold the smaller of what it says and what the arm's own file says.
"""

import math
from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from config.values import Angle, Name, NonNegative, Point, Positive, Section, Span

__all__ = [
    "ATTENDED",
    "ATTENDED_SPEED_M_S",
    "AllowedContact",
    "ArmPart",
    "Clearances",
    "ContactForce",
    "Fence",
    "GripLimits",
    "JointLimit",
    "KeepOut",
    "LimitsFile",
    "Plane",
    "Profile",
    "Speeds",
    "Stopping",
    "Touched",
    "Touching",
    "Workspace",
]

ATTENDED = "attended"
ATTENDED_SPEED_M_S = 0.25
"""No faster than this with a person at the arm: manual reduced speed of ISO 10218-1."""

Speed = Annotated[float, Meta(gt=0.0, le=10.0)]
Between0And3 = tuple[NonNegative, Span]


class ArmPart(StrEnum):
    """A point of the arm that a fence is held for."""

    TCP = "tcp"
    FLANGE = "flange"
    ELBOW = "elbow"


Parts = Annotated[tuple[ArmPart, ...], Meta(min_length=1, max_length=3)]
ONLY_TCP = (ArmPart.TCP,)


class JointLimit(Section, frozen=True, kw_only=True):
    """One joint, base to wrist 3."""

    range_rad: tuple[Angle, Angle]
    """Hard ends: the gate refuses what is beyond."""
    soft_margin_rad: Annotated[float, Meta(ge=0.0, le=3.0)]
    """So near an end the joint goes slower towards it the nearer it is; away from it as fast as anywhere."""
    speed_rad_s: Annotated[float, Meta(gt=0.0, le=10.0)]
    acceleration_rad_s2: Annotated[float, Meta(gt=0.0, le=1000.0)]
    """Greatest gain of the commanded speed. What gives way to a push is not held to it."""
    jerk_rad_s3: Annotated[float, Meta(gt=0.0, le=10_000.0)]
    """Greatest change of that gain while it grows."""
    stop_acceleration_rad_s2: Annotated[float, Meta(gt=0.0, le=1000.0)]
    """Greatest change of the commanded speed for whatever reason: a limit ahead, a turn."""
    stop_jerk_rad_s3: Annotated[float, Meta(gt=0.0, le=100_000.0)]
    """Greatest change of that."""


class Speeds(Section, frozen=True, kw_only=True):
    """Greatest speed of three points of the arm, base frame, in whatever direction."""

    tcp_m_s: Speed
    elbow_m_s: Speed
    flange_m_s: Speed


class Fence(Section, frozen=True, kw_only=True):
    """A box with edges along the base frame's axes that the parts stay inside of; of several, inside of each."""

    name: Name
    low_m: Point
    high_m: Point
    parts: Parts = ONLY_TCP


class Plane(Section, frozen=True, kw_only=True):
    """A plane that the parts stay on one side of."""

    name: Name
    point_m: Point
    """Any point of it, base frame."""
    normal: Point
    """Towards the side that is allowed, of any length but 0."""
    parts: Parts = ONLY_TCP


class KeepOut(Section, frozen=True, kw_only=True):
    """A box with edges along the base frame's axes that the parts stay out of, rounded by a radius."""

    name: Name
    low_m: Point
    high_m: Point
    radius_m: Annotated[float, Meta(ge=0.0, le=3.0)] = 0.0
    """Kept away from the box in every direction; a box without extent becomes a ball, a line a capsule."""
    parts: Parts = ONLY_TCP


class Workspace(Section, frozen=True, kw_only=True):
    """Where points of the arm may be."""

    boxes: tuple[Fence, ...] = ()
    planes: tuple[Plane, ...] = ()
    keep_outs: tuple[KeepOut, ...] = ()
    tool_cone_rad: Annotated[float, Meta(gt=0.0, le=math.pi)] = math.pi
    """How far the tool's approach axis may be from pointing straight down."""


class ContactForce(Section, frozen=True, kw_only=True):
    """Greatest force on the tool."""

    steady_n: Positive
    """Longer than one tick."""
    blow_n: Positive
    """In a single tick."""


class GripLimits(Section, frozen=True, kw_only=True):
    """What may be asked of the hand."""

    opening_m: Between0And3
    force_n: tuple[Positive, Positive]
    speed_m_s: tuple[Positive, Positive]


class Stopping(Section, frozen=True, kw_only=True):
    """What it takes to come to rest from the greatest speed of the tool; longer is not allowed."""

    distance_m: Span
    time_s: Annotated[float, Meta(gt=0.0, le=5.0)]
    deceleration_m_s2: Annotated[float, Meta(gt=0.0, le=50.0)]
    """What motion counts on when it slows down ahead of a fence."""


class Clearances(Section, frozen=True, kw_only=True):
    """Least distances that are kept between bodies."""

    self_m: Annotated[float, Meta(ge=0.0, le=0.5)]
    """Between parts of the arm that are not neighbours."""
    scene_m: Annotated[float, Meta(ge=0.0, le=0.5)]
    """Between the arm and whatever it may not touch."""


class Touching(StrEnum):
    """What of the arm may touch something."""

    FINGERS = "fingers"


class Touched(StrEnum):
    """What may be touched."""

    OBJECT = "object"
    BUTTON = "button"
    BOX = "box"
    """Its walls and its lid."""
    TABLE = "table"


class AllowedContact(Section, frozen=True, kw_only=True):
    """A pair that may touch, how hard and how fast. Pairs that are not listed may not."""

    part: Touching
    thing: Touched
    force_n: Positive
    speed_m_s: Speed
    """Of the tool, when they meet."""


class Profile(Section, frozen=True, kw_only=True):
    """One set of limits. Lengths in the base frame; a value at its limit is allowed."""

    name: Name
    joints: tuple[JointLimit, JointLimit, JointLimit, JointLimit, JointLimit, JointLimit]
    speeds: Speeds
    workspace: Workspace
    contact_force: ContactForce
    grip: GripLimits
    stopping: Stopping
    clearances: Clearances
    contacts: tuple[AllowedContact, ...]


class LimitsFile(Section, frozen=True, kw_only=True):
    """The limits of one arm with one tool."""

    name: Name
    arm: Name
    """Name of the arm's file that this is for."""
    tool: Name
    """Name of the tool in that file."""
    profiles: Annotated[tuple[Profile, ...], Meta(min_length=1, max_length=16)]

    def profile(self, name: str) -> Profile | None:
        """Return the profile of that name, None where there is none."""
        return next((profile for profile in self.profiles if profile.name == name), None)
