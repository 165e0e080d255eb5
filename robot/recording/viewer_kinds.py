"""Foxglove's messages as Protocol Buffers have them: names and numbers of fields. A table.

After github.com/foxglove/foxglove-sdk, schemas/proto; what is not used here is left out, as the format allows.
"""

import msgspec

from robot.recording.protobuf import Field, Kind
from robot.viewer_messages import CompressedImage, FrameTransforms, SceneUpdate

__all__ = ["KINDS"]


def _numbers(*names: str) -> tuple[Field, ...]:
    return tuple(Field(name, name, number, "double") for number, name in enumerate(names, start=1))


_CLOCK = (Field("sec", "seconds", 1, "int64"), Field("nsec", "nanos", 2, "int32"))
TIME, SPAN = Kind("google.protobuf.Timestamp", _CLOCK), Kind("google.protobuf.Duration", _CLOCK)
VECTOR = Kind("foxglove.Vector3", _numbers("x", "y", "z"))
QUATERNION = Kind("foxglove.Quaternion", _numbers("x", "y", "z", "w"))
COLOUR = Kind("foxglove.Color", _numbers("r", "g", "b", "a"))
POSE = Kind(
    "foxglove.Pose", (Field("position", "position", 1, VECTOR), Field("orientation", "orientation", 2, QUATERNION))
)
TRANSFORM = Kind(
    "foxglove.FrameTransform",
    (
        Field("timestamp", "timestamp", 1, TIME),
        Field("parent_frame_id", "parent_frame_id", 2, "string"),
        Field("child_frame_id", "child_frame_id", 3, "string"),
        Field("translation", "translation", 4, VECTOR),
        Field("rotation", "rotation", 5, QUATERNION),
    ),
)
_PLACED = (Field("pose", "pose", 1, POSE), Field("size", "size", 2, VECTOR))
CUBE = Kind("foxglove.CubePrimitive", (*_PLACED, Field("color", "color", 3, COLOUR)))
SPHERE = Kind("foxglove.SpherePrimitive", (*_PLACED, Field("color", "color", 3, COLOUR)))
CYLINDER = Kind(
    "foxglove.CylinderPrimitive",
    (
        *_PLACED,
        Field("bottom_scale", "bottom_scale", 3, "double"),
        Field("top_scale", "top_scale", 4, "double"),
        Field("color", "color", 5, COLOUR),
    ),
)
REMARK = Kind("foxglove.KeyValuePair", (Field("key", "key", 1, "string"), Field("value", "value", 2, "string")))
ENTITY = Kind(
    "foxglove.SceneEntity",
    (
        Field("timestamp", "timestamp", 1, TIME),
        Field("frame_id", "frame_id", 2, "string"),
        Field("id", "id", 3, "string"),
        Field("lifetime", "lifetime", 4, SPAN),
        Field("frame_locked", "frame_locked", 5, "bool"),
        Field("metadata", "metadata", 6, REMARK, is_repeated=True),
        Field("cubes", "cubes", 8, CUBE, is_repeated=True),
        Field("spheres", "spheres", 9, SPHERE, is_repeated=True),
        Field("cylinders", "cylinders", 10, CYLINDER, is_repeated=True),
    ),
)
KINDS: dict[type[msgspec.Struct], Kind] = {
    FrameTransforms: Kind(
        FrameTransforms.SCHEMA_NAME, (Field("transforms", "transforms", 1, TRANSFORM, is_repeated=True),)
    ),
    SceneUpdate: Kind(SceneUpdate.SCHEMA_NAME, (Field("entities", "entities", 2, ENTITY, is_repeated=True),)),
    CompressedImage: Kind(
        CompressedImage.SCHEMA_NAME,
        (
            Field("timestamp", "timestamp", 1, TIME),
            Field("data", "data", 2, "bytes"),
            Field("format", "format", 3, "string"),
            Field("frame_id", "frame_id", 4, "string"),
        ),
    ),
}
