"""What a camera has learnt of colours: a model for each named thing and state, and the light it was learnt in."""

from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from config.decode import decode
from config.sources import read_source
from config.values import Name, NonNegative, Positive, Section
from config.yaml_text import dump_yaml, parse_yaml
from perception.calibration.lens import Array
from perception.errors import PerceptionConfigError

__all__ = ["ColourFile", "ColourModel", "State", "distances", "load_colours", "models_of", "save_colours"]

State = Literal["", "on", "off"]
BRIGHTER_SD, DARKER_SD = 10.0, 18.0
"""At the least: light differs from lamp to lamp, and a shadow that nobody was there to sample takes half of it."""
LEAST_CHROMA_SD = 2.5
"""Just above what a person sees as a difference."""
DARK_SD = 90.0
"""One grey level of noise in a dark pixel is so much chroma, times 1 / (L* + 16)."""


class ColourModel(Section, frozen=True, kw_only=True):
    """How one thing looks at one brightness: L*, and the chroma that shading leaves alone (`colours.features`)."""

    name: Name
    state: State = ""
    """Of a lamp; empty for what has no states."""
    mean: tuple[float, float, float]
    lightness_sd: NonNegative
    chroma_covariance: tuple[float, float, float]
    """aa, ab, bb."""
    n_pixels: Annotated[int, Meta(ge=1)]


class ColourFile(Section, frozen=True, kw_only=True):
    """All that was learnt from one guided sample."""

    table_rgb: tuple[Positive, Positive, Positive]
    """The table in the sample's light, 0 to 255: what every later picture's light is measured by."""
    models: Annotated[tuple[ColourModel, ...], Meta(min_length=1, max_length=256)]
    lamps: tuple["LampModel", ...] = ()


class LampModel(Section, frozen=True, kw_only=True):
    """A lamp's dome against the table around it, off and on: lightness difference and chroma."""

    name: Name
    off: tuple[float, float, float]
    on: tuple[float, float, float]


def distances(model: ColourModel, features: Array) -> Array:
    """Return the squared distance of colours from a model, in standard deviations.  (n, 3) -> (n,)"""
    apart = features - np.array(model.mean)
    aa, ab, bb = model.chroma_covariance
    dark = (DARK_SD / (features[:, 0] + 16.0)) ** 2
    aa, bb = aa + LEAST_CHROMA_SD**2 + dark, bb + LEAST_CHROMA_SD**2 + dark
    det = aa * bb - ab * ab
    a, b = apart[:, 1], apart[:, 2]
    chroma = (bb * a * a - 2.0 * ab * a * b + aa * b * b) / det
    least = np.where(apart[:, 0] > 0.0, BRIGHTER_SD, DARKER_SD)
    return chroma + (apart[:, 0] / np.maximum(model.lightness_sd, least)) ** 2


def models_of(colours: ColourFile, name: str) -> tuple[ColourModel, ...]:
    """Return the models of a thing in all its states.

    Raises:
        PerceptionConfigError: nothing was learnt of it.
    """
    found = tuple(m for m in colours.models if m.name == name)
    if not found:
        raise PerceptionConfigError(f"expected a colour learnt for {name}: name a region of it in the sample")
    return found


def load_colours(name: str | Path) -> ColourFile:
    """Return what was learnt: a shipped file's name, or a path.

    Raises:
        ConfigError: it cannot be read or is wrong.
    """
    source = read_source("colours", name)
    return decode(parse_yaml(source.text, source.file), ColourFile, source.file)


def save_colours(path: Path, colours: ColourFile) -> None:
    """Write a file that reads back equal, whole or not at all."""
    beside = path.with_name(f".{path.name}.new")
    beside.write_text(dump_yaml(msgspec.to_builtins(colours)), encoding="utf-8")
    beside.replace(path)
