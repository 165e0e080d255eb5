"""A folder of photographs that somebody has measured: pictures and labels.yaml, with the camera's two files."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from config.decode import decode
from config.scenario import Scenario
from config.sources import read_path
from config.values import Name, Point, Section
from config.yaml_text import parse_yaml
from perception.calibration.camera_file import CameraFile, load_camera
from perception.cameras.folder import read_picture
from perception.detection import ColourFile, load_colours
from perception.errors import PerceptionConfigError
from robot.frames import frame_of
from robot.messages import ObjectPose, Vec6
from robot.photographs import Photograph

__all__ = ["CAMERA_FILE", "COLOURS_FILE", "LABELS_FILE", "LabelledFolder"]

CAMERA_FILE, COLOURS_FILE, LABELS_FILE = "camera.yaml", "colours.yaml", "labels.yaml"


class _Label(Section, frozen=True, kw_only=True):
    """One picture's truth, as a person measured it."""

    image: str
    positions_m: dict[Name, Point]
    """Of every thing of the scenario, base frame: middle of a cap, of a box's floor, of a cylinder."""
    lamps_on: tuple[Name, ...] = ()
    lids_open: tuple[Name, ...] = ()
    q_rad: Vec6 | None = None
    """The arm's joints, where it is in the picture."""
    opening_m: Annotated[float, Meta(ge=0.0, le=0.5)] = 0.0
    level: Name = "photographed"
    """What figures are told by, such as the light."""


class _Labels(Section, frozen=True, kw_only=True):
    """The file labels.yaml."""

    photographs: Annotated[tuple[_Label, ...], Meta(min_length=1)]


class LabelledFolder:
    """Photographs of a scenario's table with their truth.

    Attributes:
        camera: The camera that took them.
        colours: How the scenario's things look through it.

    Raises:
        ConfigError: a file is missing or wrong.
        PerceptionConfigError: a picture has no label for a thing, or one for something else.
    """

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        self.camera: CameraFile = load_camera(folder / CAMERA_FILE)
        self.colours: ColourFile = load_colours(folder / COLOURS_FILE)
        source = read_path(folder / LABELS_FILE)
        self._labels = decode(parse_yaml(source.text, source.file), _Labels, source.file).photographs
        self._folder = folder
        self._names = tuple(t.name for t in (*scenario.buttons, *scenario.boxes, *scenario.cylinders))
        for label in self._labels:
            wrong = sorted(set(self._names) ^ label.positions_m.keys())
            if wrong:
                raise PerceptionConfigError(
                    f"{source.file}: {label.image}: expected a place for each of {', '.join(self._names)} and nothing "
                    f"else, wrong are {', '.join(wrong)}"
                )

    @property
    def levels(self) -> tuple[str, ...]:
        """What the photographs are told by, in the file's order."""
        return tuple(dict.fromkeys(label.level for label in self._labels))

    def photographs(self, level: str) -> Iterator[Photograph]:
        """Give the photographs of a level."""
        for number, label in enumerate(self._labels):
            if label.level != level:
                continue
            picture = read_picture(self._folder / label.image)
            yield Photograph(
                frame=frame_of(picture, camera=self.camera.name, sequence=number, stamp_ns=0, arrival_ns=0),
                level=level, lamps_on=label.lamps_on, lids_open=label.lids_open, q_rad=label.q_rad,
                opening_m=label.opening_m,
                objects=tuple(
                    ObjectPose(name=n, position_m=label.positions_m[n], quat=(1.0, 0.0, 0.0, 0.0)) for n in self._names
                ),
            )  # fmt: skip
