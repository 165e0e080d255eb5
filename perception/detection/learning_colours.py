"""Colours learnt from a guided sample: what is inside the regions that a person named."""

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.scenario import Scenario
from perception.calibration.camera_file import CameraFile
from perception.calibration.lens import Array
from perception.detection.colour_file import ColourFile, ColourModel, LampModel
from perception.detection.colours import features
from perception.detection.detector import Detector
from perception.detection.eye import Eye
from perception.detection.glance import Field
from perception.detection.light import gains, table_light
from perception.detection.regions import Region
from perception.errors import CalibrationRefusedError
from perception.opencv import opencv
from robot.frames import Frame, Picture, picture_of

__all__ = ["learn_colours"]

LEAST_PIXELS = 60
BIN_LIGHTNESS = 12.0
"""A thing's lit top, its shaded side and what is in a shadow differ in more than brightness once a channel is full."""
RAGGED = 1.0
"""Percent of a bin's pixels at either end of each chroma that are left out: a region's ragged edge."""


def learn_colours(
    frames: Mapping[str, Frame], regions: Sequence[Region], *, camera: CameraFile, scenario: Scenario
) -> ColourFile:
    """Return models of all that was named, and of each lamp that was named both on and off.

    Args:
        frames: the sample's pictures by name.
        regions: what a person named in them.
        camera: the camera that took them.
        scenario: the table on them.

    Raises:
        CalibrationRefusedError: no table to measure the light by, or a region too small; all reasons at once.
    """
    field = Field.of(Eye(camera), scenario)
    pictures = {name: picture_of(frame) for name, frame in frames.items()}
    lights = {name: table_light(picture, field.table) for name, picture in pictures.items()}
    dark = [name for name, light in lights.items() if light is None]
    if dark or not lights:
        raise CalibrationRefusedError(f"expected a lit table in {', '.join(dark) or 'at least one picture'}")
    told = {name: light for name, light in lights.items() if light is not None}
    reference = next(iter(told.values()))
    colour_by_thing: dict[tuple[str, str], list[Array]] = {}
    for region in regions:
        rgb = _inside(pictures[region.image], region) * gains(told[region.image], reference) / 255.0
        colour_by_thing.setdefault((region.name, region.state), []).append(rgb)
    pooled = {key: np.concatenate(parts) for key, parts in colour_by_thing.items()}
    small = [f"{name} {state}".strip() for (name, state), rgb in pooled.items() if len(rgb) < LEAST_PIXELS]
    if small:
        raise CalibrationRefusedError(f"expected regions of {LEAST_PIXELS} pixels or more of {', '.join(small)}")
    red, green, blue = reference.tolist()
    colours = ColourFile(
        table_rgb=(red, green, blue),
        models=tuple(model for key, rgb in pooled.items() for model in _models(key, features(rgb))),
    )
    lamps = _lamps(frames, regions, Detector(camera=camera, scenario=scenario, colours=colours))
    return msgspec.structs.replace(colours, lamps=lamps)


def _inside(picture: Picture, region: Region) -> NDArray[np.float64]:
    mask = np.zeros(picture.shape[:2], np.uint8)
    opencv().fillPoly(mask, [np.round(np.array(region.polygon_px)).astype(np.int32)], 1)
    return picture[mask > 0].astype(np.float64)


def _models(key: tuple[str, str], seen: Array) -> list[ColourModel]:
    """Return one thing's models, one for each range of brightness that it was seen in."""
    bins = np.floor(seen[:, 0] / BIN_LIGHTNESS)
    parts = [seen[bins == level] for level in np.unique(bins)]
    large = [part for part in parts if len(part) >= LEAST_PIXELS / 2]
    return [_model(key, part) for part in large or [seen]]


def _model(key: tuple[str, str], seen: Array) -> ColourModel:
    low, high = np.percentile(seen[:, 1:], [RAGGED, 100.0 - RAGGED], axis=0)
    core = seen[((seen[:, 1:] >= low) & (seen[:, 1:] <= high)).all(axis=1)]
    apart = core - core.mean(axis=0)
    covariance = apart[:, 1:].T @ apart[:, 1:] / len(core)
    lightness, a, b = core.mean(axis=0).tolist()
    name, state = key
    fields = {
        "name": name,
        "state": state,
        "mean": (lightness, a, b),
        "lightness_sd": float(apart[:, 0].std()),
        "chroma_covariance": (float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])),
        "n_pixels": len(core),
    }
    return msgspec.convert(fields, ColourModel)


def _lamps(frames: Mapping[str, Frame], regions: Sequence[Region], detector: Detector) -> tuple[LampModel, ...]:
    """Return what the detector itself reads of each dome in pictures where a person says how its lamp is."""
    readings = {name: detector.dome_readings(frame) for name, frame in frames.items()}
    seen: dict[tuple[str, str], list[Array]] = {}
    for region in regions:
        if region.state and region.name in readings[region.image]:
            seen.setdefault((region.name, region.state), []).append(readings[region.image][region.name])
    lamps = []
    for name in sorted({name for name, _ in seen}):
        if (name, "on") in seen and (name, "off") in seen:
            off, on = (np.mean(seen[name, state], axis=0).tolist() for state in ("off", "on"))
            lamps.append(LampModel(name=name, off=tuple(off), on=tuple(on)))
    return tuple(lamps)
