"""What was made of one picture. Nothing here is a guess: what could not be told is UNKNOWN."""

from enum import StrEnum

from robot.messages import Message, Vec3

__all__ = ["Detections", "LampSeen", "LampState", "LidSeen", "LidState", "Stance", "ThingSeen"]


class Stance(StrEnum):
    """How a thing stands on the table."""

    FIXED = "fixed"
    STANDING = "standing"
    LYING = "lying"
    UNKNOWN = "unknown"


class LampState(StrEnum):
    """Whether a lamp is lit."""

    ON = "on"
    OFF = "off"
    UNKNOWN = "unknown"


class LidState(StrEnum):
    """How a box's leaves are; on their way they are unknown."""

    OPEN = "open"
    SHUT = "shut"
    UNKNOWN = "unknown"


class ThingSeen(Message, frozen=True, kw_only=True):
    """One thing of the scenario in one picture."""

    name: str
    position_m: Vec3 | None
    """Base frame: the middle of a button's cap, of a box's floor, of a cylinder; none where it cannot be told."""
    stance: Stance
    axis_rad: float | None
    """Direction of a lying cylinder's axis in the table plane, 0 to pi; none for everything else."""
    confidence: float
    """0 to 1: how much of what should be seen there is seen, and nothing else; 0 where the place is unknown."""
    visible: float
    """0 to 1: the share of its outline's inside that nothing known stands before."""
    is_gone: bool = False
    """Its place is not told, and where it was seen before one sees something else, with nothing before it."""


class LampSeen(Message, frozen=True, kw_only=True):
    """One button's lamp."""

    name: str
    state: LampState
    score: float | None
    """0 as in the sample with the lamp off, 1 as with the lamp on; none where it cannot be told."""


class LidSeen(Message, frozen=True, kw_only=True):
    """One box's lid."""

    name: str
    state: LidState
    confidence: float
    """How much better its edges fit than those of the other state: 0 to 1."""


class Detections(Message, frozen=True, kw_only=True):
    """All that one picture shows; things in the scenario's order: buttons, boxes, cylinders."""

    stamp_ns: int
    """Middle of the picture's exposure."""
    things: tuple[ThingSeen, ...]
    lamps: tuple[LampSeen, ...]
    lids: tuple[LidSeen, ...]
    is_lit: bool = True
    """Whether the table's light could be told: nothing is known of a picture that is black, full or covered."""
