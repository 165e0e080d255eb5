"""What a person writes down beside the pictures: touched corners of boards lying still, or the tool's poses."""

from pathlib import Path
from typing import Annotated

from msgspec import Meta

from config.decode import decode
from config.sources import read_path
from config.values import Angle, Point, Section
from config.yaml_text import parse_yaml

__all__ = [
    "POSES_FILE",
    "TOUCHES_FILE",
    "Placement",
    "Poses",
    "ToolPose",
    "Touch",
    "Touches",
    "load_poses",
    "load_touches",
]

TOUCHES_FILE, POSES_FILE = "touches.yaml", "poses.yaml"


class Touch(Section, frozen=True, kw_only=True):
    """Where the tool's tip was when it touched one corner of the board."""

    corner: Annotated[int, Meta(ge=0)]
    """Number of an inner corner, row by row from the first square, from 0."""
    position_m: Point
    """Base frame."""


class Placement(Section, frozen=True, kw_only=True):
    """A board that lay still: pictures of it without the arm in the way, and what was touched."""

    images: Annotated[tuple[str, ...], Meta(min_length=1)]
    touches: Annotated[tuple[Touch, ...], Meta(min_length=1)]


class Touches(Section, frozen=True, kw_only=True):
    """The file touches.yaml."""

    placements: Annotated[tuple[Placement, ...], Meta(min_length=1)]


class ToolPose(Section, frozen=True, kw_only=True):
    """Where the tool was, at rest, when a picture of the board in its hand was taken."""

    image: str
    position_m: Point
    """Tool centre point, base frame."""
    rotation_vector_rad: tuple[Angle, Angle, Angle]
    """Turn of the tool: the pendant's RX, RY, RZ in rad."""


class Poses(Section, frozen=True, kw_only=True):
    """The file poses.yaml."""

    views: Annotated[tuple[ToolPose, ...], Meta(min_length=1)]


def load_touches(folder: Path) -> Touches:
    """Return what was touched. Raises ConfigError where the file is absent or wrong."""
    source = read_path(folder / TOUCHES_FILE)
    return decode(parse_yaml(source.text, source.file), Touches, source.file)


def load_poses(folder: Path) -> Poses:
    """Return the tool's poses. Raises ConfigError where the file is absent or wrong."""
    source = read_path(folder / POSES_FILE)
    return decode(parse_yaml(source.text, source.file), Poses, source.file)
