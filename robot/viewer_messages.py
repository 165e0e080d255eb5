"""Foxglove's well-known messages, as far as they are used here: viewers know them by their names and fields.

Field for field after https://docs.foxglove.dev/docs/visualization/message-schemas (FrameTransforms, SceneUpdate,
CompressedImage).
"""

from typing import ClassVar

import msgspec

__all__ = [
    "Colour", "CompressedImage", "Cube", "Cylinder", "Deletion", "FrameTransform", "FrameTransforms", "Pose",
    "Quaternion", "SceneEntity", "SceneUpdate", "Sphere", "Stamp", "Vector", "stamp_of",
]  # fmt: skip

_NS = 1_000_000_000


class Stamp(msgspec.Struct, frozen=True, kw_only=True):
    """A time, or a length of time."""

    sec: int = 0
    nsec: int = 0


class Vector(msgspec.Struct, frozen=True):
    """A point, a displacement or a size, metres."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Quaternion(msgspec.Struct, frozen=True):
    """A turn; here the scalar comes last, as viewers have it."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Pose(msgspec.Struct, frozen=True, kw_only=True):
    """Where a body is in its frame."""

    position: Vector = Vector()
    orientation: Quaternion = Quaternion()


class Colour(msgspec.Struct, frozen=True):
    """Red, green, blue, opacity, each from 0 to 1."""

    r: float
    g: float
    b: float
    a: float = 1.0


class FrameTransform(msgspec.Struct, frozen=True, kw_only=True):
    """Where a frame is in its parent's."""

    timestamp: Stamp
    parent_frame_id: str
    child_frame_id: str
    translation: Vector
    rotation: Quaternion


class FrameTransforms(msgspec.Struct, frozen=True, kw_only=True):
    """Several of them."""

    SCHEMA_NAME: ClassVar[str] = "foxglove.FrameTransforms"

    transforms: tuple[FrameTransform, ...]


class Cube(msgspec.Struct, frozen=True, kw_only=True):
    """A box."""

    pose: Pose
    size: Vector
    color: Colour


class Cylinder(msgspec.Struct, frozen=True, kw_only=True):
    """A cylinder along its frame's z axis."""

    pose: Pose
    size: Vector
    bottom_scale: float = 1.0
    top_scale: float = 1.0
    color: Colour


class Sphere(msgspec.Struct, frozen=True, kw_only=True):
    """A ball."""

    pose: Pose
    size: Vector
    color: Colour


class KeyValue(msgspec.Struct, frozen=True, kw_only=True):
    """A remark."""

    key: str
    value: str


class SceneEntity(msgspec.Struct, frozen=True, kw_only=True):
    """One thing with its shapes; the newest of its name replaces the one before."""

    timestamp: Stamp
    frame_id: str
    id: str
    lifetime: Stamp = Stamp()
    """Zero stays."""
    frame_locked: bool = True
    metadata: tuple[KeyValue, ...] = ()
    cubes: tuple[Cube, ...] = ()
    spheres: tuple[Sphere, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()


class Deletion(msgspec.Struct, frozen=True, kw_only=True):
    """A thing that is shown no more."""

    timestamp: Stamp
    type: int = 0
    id: str


class CompressedImage(msgspec.Struct, frozen=True, kw_only=True):
    """A picture of a camera."""

    SCHEMA_NAME: ClassVar[str] = "foxglove.CompressedImage"

    timestamp: Stamp
    """Middle of the exposure."""
    frame_id: str
    """The camera's name."""
    data: bytes
    format: str
    """jpeg or png."""


class SceneUpdate(msgspec.Struct, frozen=True, kw_only=True):
    """Things that are new or others now."""

    SCHEMA_NAME: ClassVar[str] = "foxglove.SceneUpdate"

    deletions: tuple[Deletion, ...] = ()
    entities: tuple[SceneEntity, ...] = ()


def stamp_of(ns: int) -> Stamp:
    """Return a time."""
    return Stamp(sec=ns // _NS, nsec=ns % _NS)
