"""What crosses the pipe between a station and its servo process."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from robot.messages import ArmState, GripCommand, Intent, PlantIdentity, Vec3
from robot.surroundings import Surroundings
from robot.tick_loop import Stride
from robot.tick_notes import TickNote

__all__ = [
    "BeginEpoch",
    "Close",
    "Connect",
    "Connected",
    "Done",
    "Engage",
    "Failure",
    "Measure",
    "Outputs",
    "Reply",
    "Request",
    "Seed",
    "Seeded",
    "Stop",
    "StrideReply",
    "StrideRequest",
    "pack_intent",
    "unpack_intent",
]


class _Tagged(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """Base: the name of the class tells what it is."""


class Connect(_Tagged, frozen=True, kw_only=True):
    """Acquire the arm; answered by Connected."""


class Engage(_Tagged, frozen=True, kw_only=True):
    """Take command; answered by Done."""


class Seed(_Tagged, frozen=True, kw_only=True):
    """Start from the measured state, and hold it from now on; answered by Seeded."""


class Measure(_Tagged, frozen=True, kw_only=True):
    """Read the arm, in command of it or not; answered by Seeded."""


class BeginEpoch(_Tagged, frozen=True, kw_only=True):
    """Take up an epoch's rules; answered by Outputs."""

    epoch: int


class StrideRequest(_Tagged, frozen=True, kw_only=True):
    """Carry out an intent for so many ticks; answered by StrideReply when they are over."""

    intent: msgspec.Raw
    """As pack_intent makes it: whatever was asked for crosses, for it is the gate that refuses it."""
    grip: GripCommand
    n_ticks: Annotated[int, Meta(ge=1)]
    sequence: int
    """One more than that of the time step before, from 1 on since the arm was seeded."""
    wait_at_m: Vec3 | None = None
    """Where the tool waits for the hand, base frame; None where it need not wait."""
    around: Surroundings | None = None
    """What is perceived; None where nobody perceives anything."""


class Stop(_Tagged, frozen=True, kw_only=True):
    """Stop the arm and give up command; answered by Done."""


class Close(_Tagged, frozen=True, kw_only=True):
    """Stop, release and end; answered by Done."""


Request = Connect | Engage | Seed | Measure | BeginEpoch | StrideRequest | Stop | Close


class Connected(_Tagged, frozen=True, kw_only=True):
    """The arm is acquired."""

    identity: PlantIdentity


class Seeded(_Tagged, frozen=True, kw_only=True):
    """What was measured."""

    state: ArmState


class Outputs(_Tagged, frozen=True, kw_only=True):
    """Outputs that an epoch begins with."""

    bits: int


class StrideReply(_Tagged, frozen=True, kw_only=True):
    """What the time step came to."""

    stride: Stride
    is_asked: bool = True
    """It answers a request; otherwise it tells what latched between time steps."""
    notes: tuple[TickNote, ...] = ()
    """Of ticks since the last one."""


class Done(_Tagged, frozen=True, kw_only=True):
    """It is done."""


class Failure(_Tagged, frozen=True, kw_only=True):
    """It was not done: an error of the robot package, by its class's name."""

    kind: str
    message: str
    is_end: bool = False
    """Nothing is known of the arm any more: the process ends."""


Reply = Connected | Seeded | Outputs | StrideReply | Done | Failure


def pack_intent(intent: object) -> msgspec.Raw:
    """Return what crosses for an intent, or for what somebody took for one; for what cannot cross, nothing does."""
    try:
        return msgspec.Raw(msgspec.msgpack.encode(intent))
    except TypeError:
        return msgspec.Raw(msgspec.msgpack.encode(None))


def unpack_intent(packed: msgspec.Raw) -> Any:  # noqa: ANN401 - what is no intent is told by the gate
    """Return the intent that crossed; what is none comes as plain values or as None, which the gate refuses."""
    try:
        return _intent_of(packed)
    except msgspec.ValidationError:
        return _plain(packed)
    except (ValueError, RecursionError):
        return None


def _plain(packed: msgspec.Raw) -> Any:  # noqa: ANN401 - whatever it is
    try:
        return msgspec.msgpack.decode(packed)
    except (ValueError, RecursionError):
        return None


_intent_of = msgspec.msgpack.Decoder(Intent).decode
