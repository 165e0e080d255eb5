"""The guided sample: pictures in which a person has named regions."""

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from config.decode import decode
from config.sources import read_path
from config.values import Name, Section
from config.yaml_text import parse_yaml
from perception.detection.colour_file import State
from robot.photographs import NamedRegion

__all__ = ["REGIONS_FILE", "Region", "Regions", "load_regions"]

REGIONS_FILE = "regions.yaml"


class Region(Section, frozen=True, kw_only=True):
    """A polygon inside what it names; nothing else may be in it."""

    image: str
    name: Name
    """Of the scenario; `table` is its top, any other name is something that may be on the pictures too."""
    state: State = ""
    """`on` or `off` for a button, by its lamp."""
    polygon_px: Annotated[tuple[tuple[float, float], ...], Meta(min_length=3)]

    @staticmethod
    def named(*, image: str, region: NamedRegion) -> "Region":
        """Return a region that came with a photograph, checked as one in a file is."""
        return msgspec.convert({"image": image, **msgspec.to_builtins(region)}, Region)


class Regions(Section, frozen=True, kw_only=True):
    """The file regions.yaml."""

    regions: Annotated[tuple[Region, ...], Meta(min_length=1)]


def load_regions(folder: Path) -> Regions:
    """Return what a person named. Raises ConfigError where the file is absent or wrong."""
    source = read_path(folder / REGIONS_FILE)
    return decode(parse_yaml(source.text, source.file), Regions, source.file)
