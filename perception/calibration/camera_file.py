"""One camera's file: what it is, its lens, where it stands, and how well each is known."""

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from config.decode import decode
from config.sources import read_path, read_source
from config.values import Name, NonNegative, Point, Section
from config.yaml_text import dump_yaml, parse_yaml
from perception.calibration.board import Board, check_board
from perception.calibration.lens import Lens
from perception.calibration.poses import Pose

__all__ = [
    "CameraFile", "ExtrinsicsRecord", "LensRecord", "Verification", "ViewRecord", "load_board", "load_camera", "save",
]  # fmt: skip

Day = Annotated[str, Meta(pattern=r"^[0-9]{4}-[0-9]{2}-[0-9]{2}\Z")]


class ViewRecord(Section, frozen=True, kw_only=True):
    """What is left of one picture's corners after the fit."""

    image: str
    n_corners: int
    rms_px: NonNegative
    blur_px: NonNegative


class LensRecord(Section, frozen=True, kw_only=True):
    """How the lens came about."""

    date: Day
    rms_px: NonNegative
    focal_sd_px: NonNegative
    centre_sd_px: NonNegative
    views: tuple[ViewRecord, ...]


class ExtrinsicsRecord(Section, frozen=True, kw_only=True):
    """Where the camera is, base frame, and how that came about."""

    date: Day
    method: str
    """`table`: touched boards lying still; `tool`: a board carried by the arm."""
    pose: Pose
    rms_px: NonNegative
    touch_rms_mm: NonNegative | None
    """How far touches are from the board that fits them best; none where the arm carried it."""
    expected_mm: NonNegative
    """What the corners' scatter makes of a point of the table, rms over the arm's workspace."""
    points_m: tuple[Point, ...]
    """What was touched for the fit: a check has to be elsewhere."""
    views: tuple[ViewRecord, ...]


class Verification(Section, frozen=True, kw_only=True):
    """Touched points outside the fit against where the camera sees them, along the table."""

    date: Day
    n_points: int
    mean_mm: NonNegative
    p95_mm: NonNegative
    max_mm: NonNegative


class CameraFile(Section, frozen=True, kw_only=True):
    """All that is known of one camera."""

    name: Name
    serial: str
    board: Board
    lens: Lens
    intrinsics: LensRecord
    extrinsics: ExtrinsicsRecord | None = None
    verified: Verification | None = None


def load_camera(name: str | Path) -> CameraFile:
    """Return a camera's file: a shipped one's name, or a path.

    Raises:
        ConfigError: it cannot be read or is wrong.
    """
    source = read_source("cameras", name)
    return decode(parse_yaml(source.text, source.file), CameraFile, source.file)


def load_board(path: Path) -> Board:
    """Return a board's file.

    Raises:
        ConfigError: it cannot be read or is wrong.
        PerceptionConfigError: such a board cannot be.
    """
    source = read_path(path)
    board = decode(parse_yaml(source.text, source.file), Board, source.file)
    check_board(board)
    return board


def save(path: Path, content: CameraFile | Board) -> None:
    """Write a file that reads back equal, whole or not at all."""
    beside = path.with_name(f".{path.name}.new")
    beside.write_text(dump_yaml(msgspec.to_builtins(content)), encoding="utf-8")
    beside.replace(path)
