"""Labelled pictures: a frame, and what a person or a simulated world says of it. What a perception is tried on."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from robot.frames import Frame
from robot.messages import Message, ObjectPose, Vec3, Vec6

__all__ = ["BoardPhotograph", "NamedRegion", "Photograph", "Photographer", "PrintedBoard"]

Pixel = tuple[float, float]


class Photograph(Message, frozen=True, kw_only=True):
    """One picture of a scenario's table and what was on it."""

    frame: Frame
    level: str
    """What it was taken under, in one word; figures are told by it."""
    objects: tuple[ObjectPose, ...]
    """Truth, in the scenario's order: buttons (their caps), boxes (middle of the floor), cylinders; base frame."""
    lamps_on: tuple[str, ...]
    """Buttons whose lamps were lit."""
    lids_open: tuple[str, ...]
    q_rad: Vec6 | None
    """The arm's joints, where there was one."""
    opening_m: float
    """Of its jaws."""


class NamedRegion(Message, frozen=True, kw_only=True):
    """A polygon that a person drew inside one thing on a picture."""

    name: str
    state: str
    polygon_px: tuple[Pixel, ...]


class PrintedBoard(Message, frozen=True, kw_only=True):
    """A calibration board's sheet, as it comes out of a printer, and the corners that a person would touch."""

    pixels: bytes
    """Grey rows from the top."""
    width_px: int
    height_px: int
    size_m: tuple[float, float]
    corners: tuple[tuple[int, float, float], ...]
    """Number, and metres from the sheet's upper left corner to the right and down."""


class BoardPhotograph(Message, frozen=True, kw_only=True):
    """A picture of a printed board, and what was touched of it while it lay there."""

    frame: Frame
    touches_m: tuple[tuple[int, Vec3], ...]
    """Number of a corner and where the tool's tip was at it; none where the board was not touched."""


class Photographer(Protocol):
    """What a bench of a perception takes its pictures from, by import string; it says only what a lab could say."""

    def close(self) -> None:
        """Give up what takes them. Idempotent, never raises."""
        ...

    def boards(self, board: PrintedBoard) -> Iterator[BoardPhotograph]:
        """Give pictures of a printed board: for the lens (not touched), then lying on the table (touched)."""
        ...

    def sample(self) -> Sequence[tuple[Photograph, tuple[NamedRegion, ...]]]:
        """Give the guided sample: pictures and what a person names in them."""
        ...

    def photographs(self, seeds: Sequence[int], level: str) -> Iterator[Photograph]:
        """Give one picture a seed, perturbed as the level says."""
        ...
