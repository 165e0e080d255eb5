"""What a stream may ask of a station at one instant, what it sees, and what it is told of the place."""

from collections.abc import Callable, Iterator

import msgspec

from robot.messages import Box3, GripCommand, Vec3, Vec6

__all__ = ["Arena", "Ask", "Look", "Maker", "Seen", "Send", "Silence", "Write"]


class Send(msgspec.Struct, frozen=True):
    """An intent, or what is none, through the station's door, for so many ticks."""

    intent: object
    n_ticks: int = 1


class Silence(msgspec.Struct, frozen=True):
    """Nothing is asked while time goes on."""

    n_ticks: int


class Write(msgspec.Struct, frozen=True, kw_only=True):
    """Joints straight to the gate, past all shaping: what a mistake in motion would send."""

    q_rad: object
    grip: GripCommand | None = None
    """None keeps what was asked last."""
    sequence_off: int = 0
    """Added to the number that the gate expects."""
    stamp_off_ns: int = 0
    """Added to the present: negative is old, positive from the future."""
    digital_out: int | None = None


Ask = Send | Silence | Write


class Seen(msgspec.Struct, frozen=True, kw_only=True):
    """What a driver sees: where the arm is by its own measurement."""

    q_rad: Vec6
    tcp_m: Vec3
    force_n: Vec3
    is_latched: bool = False


class Arena(msgspec.Struct, frozen=True, kw_only=True):
    """What hostile streams aim at and how fast they may usefully be, base frame."""

    tick_s: float
    speed_m_s: float
    """Greatest speed of the tool that is allowed."""
    box_m: Box3
    """Where the tool may be."""
    q_min_rad: Vec6
    q_max_rad: Vec6
    qd_max_rad_s: Vec6
    home_rad: Vec6
    things_m: tuple[Vec3, ...]
    """Tops of what stands on the table."""
    loose_m: tuple[Vec3, ...]
    """What can be grasped."""
    fences_m: tuple[Vec3, ...]
    """Points beyond planes and inside keep-outs."""
    grip: tuple[GripCommand, GripCommand]
    """The hand open and shut with what it may be asked for at most."""
    grip_least: GripCommand
    """The hand shut with the least that it may be asked for."""


Look = Callable[[], Seen]
"""Returns the newest measurement."""
Maker = Callable[..., Iterator[Ask]]
"""(look, arena, rng) -> what is asked, one after another, for ever."""
