"""What crosses the bus about pictures: where a camera's newest one lies, and how a simulated world stands."""

import msgspec

__all__ = ["MEMORY_NAME", "Forget", "Forgotten", "FrameNote", "Light", "TwinPose"]

MEMORY_NAME = r"^autotelic-[A-Za-z0-9_.-]{1,100}\Z"
"""Names of shared memory that a reader opens: no path leads out of where memory is shared."""


class FrameNote(msgspec.Struct, frozen=True, kw_only=True):
    """One frame lies in shared memory. The envelope's stamp is the middle of its exposure."""

    camera: str
    serial: str
    sequence: int
    """Counts what the camera took; a gap is a frame that was lost before it came here."""
    stamp_ns: int
    """Middle of the exposure, by the monotonic clock of the camera's machine."""
    arrival_ns: int
    """When it could be had, by the same."""
    width_px: int
    height_px: int
    memory: str
    """Where it lies; another one after the camera's process was started anew."""
    number: int
    """Which of those that were ever written there; its place is used again some frames later."""


class Light(msgspec.Struct, frozen=True, kw_only=True):
    """Whether a camera's pictures show the table in a light that it can be seen by."""

    camera: str
    dark_s: float
    """How long there was no such picture."""


class TwinPose(msgspec.Struct, frozen=True, kw_only=True):
    """How the twin's world stands, for a process that renders a camera.

    Simulation only: no real arm has such a thing, and nobody but a rendered camera may look at it.
    """

    model_sha256: str
    """Of the model, before anything was moved: who draws another one would draw another world."""
    qpos: tuple[float, ...]
    """Of all that moves, in the model's order."""
    fixtures_m: tuple[tuple[float, float], ...]
    """Where buttons, then boxes, stand."""
    digital_out: int
    """Bit i is output i: which lamps are lit."""


class Forget(msgspec.Struct, frozen=True, kw_only=True):
    """The table was laid out anew: what was seen of it before says nothing any more."""


class Forgotten(msgspec.Struct, frozen=True, kw_only=True):
    """It is forgotten; percepts from now on are of the table as it is."""
