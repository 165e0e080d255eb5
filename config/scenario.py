"""A scenario: the table, what is on it, how it is wired over time, and the goals it offers."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from config.values import Colour, Length, Name, Point, Section, Span

__all__ = [
    "Box",
    "Button",
    "Cylinder",
    "Evaluation",
    "Goal",
    "GoalKind",
    "Lid",
    "Reflexes",
    "RuleSpan",
    "Scenario",
    "Start",
    "Table",
]

Planar = tuple[Length, Length]
Spread = tuple[Annotated[float, Meta(ge=0.0, le=0.5)], Annotated[float, Meta(ge=0.0, le=0.5)]]


class Table(Section, frozen=True, kw_only=True):
    """The table top, base frame."""

    centre_m: Planar = (0.45, 0.0)
    size_m: tuple[Span, Span] = (0.8, 1.2)
    height_m: Length = 0.0
    colour: Colour = (0.72, 0.66, 0.58)


class Button(Section, frozen=True, kw_only=True):
    """An illuminated sprung dome button. Its travel closes a digital input, its lamp is a digital output."""

    name: Name
    position_m: Planar
    spread_m: Spread = (0.0, 0.0)
    """Half extents of the region its centre is drawn from at each reset."""
    colour: Colour
    diameter_m: Span = 0.1
    height_m: Span = 0.05
    travel_m: Annotated[float, Meta(ge=0.002, le=0.03)] = 0.01
    cap_m: Annotated[float, Meta(ge=0.002, le=0.05)] = 0.012
    """How much of its height, from the cap's edge down, wears the cap's colour."""
    dome_m: Annotated[float, Meta(ge=0.0, le=0.03)] = 0.006
    """How far the lit dome rises above the cap's edge, in its middle."""
    input: Annotated[int, Meta(ge=0, le=15)]
    lamp_output: Annotated[int, Meta(ge=0, le=15)]


class Lid(Section, frozen=True, kw_only=True):
    """Two leaves on hinges, driven by one digital output: on opens, off shuts and locks."""

    output: Annotated[int, Meta(ge=0, le=15)]
    open_angle_rad: Annotated[float, Meta(gt=0.5, le=2.6)] = 1.85
    speed_rad_s: Annotated[float, Meta(ge=0.2, le=2.0)] = 1.95
    """At the least, the widest lid is open after 13 s, half an epoch of the shipped learners."""
    force_n: Annotated[float, Meta(ge=0.5, le=5.0)] = 4.0
    """Greatest force at a leaf's free edge; a leaf's own weight takes 0.3 N of it."""
    thickness_m: Annotated[float, Meta(ge=0.001, le=0.03)] = 0.005
    """Of a leaf, whose hinge is in its middle."""
    padding_m: Annotated[float, Meta(ge=0.0, le=0.03)] = 0.012
    """On top of a shut leaf."""


class Box(Section, frozen=True, kw_only=True):
    """An open-topped box fixed to the table, with or without a driven lid."""

    name: Name
    position_m: Planar
    spread_m: Spread = (0.0, 0.0)
    colour: Colour
    inner_m: tuple[Span, Span] = (0.18, 0.18)
    wall_m: Annotated[float, Meta(ge=0.002, le=0.03)] = 0.005
    height_m: Span = 0.075
    lid: Lid | None = None
    presence_input: Annotated[int, Meta(ge=0, le=15)] | None = None
    """Digital input of a sensor that sees something lying in the box."""


class Cylinder(Section, frozen=True, kw_only=True):
    """A loose cylinder, standing in a box or on the table."""

    name: Name
    inside: Name | None = None
    """Box it starts in; its position is then relative to the box's centre."""
    position_m: Planar = (0.0, 0.0)
    spread_m: Spread = (0.0, 0.0)
    colour: Colour
    diameter_m: Annotated[float, Meta(ge=0.01, le=0.08)] = 0.044
    height_m: Span = 0.06
    mass_kg: Annotated[float, Meta(ge=0.01, le=3.0)] = 0.45
    friction: Annotated[float, Meta(ge=0.05, le=3.0)] = 0.5
    receptacle: Name | None = None
    """Box that the hand opens over when it holds this."""
    is_distractor: bool = False
    """Seen and movable, but no goal is about it."""


class GoalKind(StrEnum):
    """What is asked of a goal's object."""

    PRESSED = "pressed"
    GRABBED = "grabbed"
    IN_BOX = "in_box"


class Goal(Section, frozen=True, kw_only=True):
    """A goal, judged on the percept. The learner knows only its index."""

    name: Name
    kind: GoalKind
    object: Name
    box: Name | None = None
    """For in_box: which box."""
    from_epoch: Annotated[int, Meta(ge=0)] = 0
    """Epoch from which the learner knows of it: before, it neither judges it nor can want it."""


class RuleSpan(Section, frozen=True, kw_only=True):
    """A rule set and the epoch from which it is in force."""

    from_epoch: Annotated[int, Meta(ge=0)]
    rules: str
    """A shipped rule set's name or a path to a file."""


class Start(Section, frozen=True, kw_only=True):
    """Where the tool centre point starts an epoch: a box it is drawn from, base frame."""

    position_m: tuple[Length, Length, Length] = (0.42, 0.0, 0.225)
    spread_m: tuple[Span, Span, Span] = (0.06, 0.1, 0.005)


class Reflexes(Section, frozen=True, kw_only=True):
    """Reflexes of the hand: given, not learnt."""

    close_on_object: bool = True
    """Close when an object lies between the jaws at the bottom of a descent."""
    open_over_receptacle: bool = True
    """Open when the held object is inside its receptacle's rim."""
    open_on_table: bool = True
    """Open when a held object is driven down on free table after it was lifted."""
    lift_m: Span = 0.03
    """How far an object must have been lifted before it may be put down on the table."""


class Evaluation(Section, frozen=True, kw_only=True):
    """How far the tool may be off for a place to count as reached."""

    reach_radius_m: Span = 0.03
    reach_height_m: Span = 0.02


class Scenario(Section, frozen=True, kw_only=True):
    """One table with its wiring over epochs and its goals."""

    name: Name
    description: str = ""
    table: Table = Table()
    buttons: tuple[Button, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    distances: Annotated[tuple[Name, ...], Meta(min_length=1, max_length=64)]
    """What d_1..d_n are measured to, in this order; `table` is the table top under the tool."""
    goals: Annotated[tuple[Goal, ...], Meta(min_length=1, max_length=24)]
    schedule: Annotated[tuple[RuleSpan, ...], Meta(min_length=1)]
    workspace_m: tuple[Point, Point] | None = None
    """Corners of the box that the tool centre point may be in, base frame, within the arm's own; None is all of it."""
    start: Start = Start()
    reflexes: Reflexes = Reflexes()
    evaluation: Evaluation = Evaluation()
