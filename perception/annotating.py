"""A picture with what is made of it drawn in: outlines where things are believed, what is said of each, residuals."""

import math
from collections.abc import Sequence

import numpy as np

from config.scenario import Box, Button, Cylinder, Scenario
from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.shapes import cap_points, hull, lying_points, standing_points
from perception.opencv import opencv
from robot.frames import Picture
from robot.messages import ObjectPercept, Percept, SceneState

__all__ = ["annotated"]

SCALE = 2
SEEN, REMEMBERED, UNKNOWN, ARM, TRUE = (60, 255, 60), (255, 210, 60), (255, 90, 90), (190, 190, 200), (255, 60, 255)
FRESH_S = 0.12
UPRIGHT_W = 0.9
TEXT, LINE_PX, FIRST_PX, PANEL_PX = 0.5, 20, 24, 430
"""Size of letters, of their lines, where the first line is, and how wide the words' dark panel is."""
MM = 1e3


def annotated(
    picture: Picture, eye: Eye, scenario: Scenario, percept: Percept, *, arm: Sequence[Array] = (),
    truth: SceneState | None = None,
) -> Picture:  # fmt: skip
    """Return a picture twice as large, with what a percept says.

    Green is seen now, yellow was seen before, red is not known; grey is the arm by its joints; a magenta cross is where
    a simulated world says that a thing is.

    Args:
        picture: what the camera saw.
        eye: the camera.
        scenario: sizes and heights.
        percept: what was made of it.
        arm: the arm's outlines.  each (n, 2) px
        truth: where things are, where somebody knows.
    """
    cv2 = opencv()
    drawn = cv2.resize(picture, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_LINEAR)
    for outline in arm:
        _draw(drawn, outline, ARM, 1)
    true_m = {} if truth is None else {o.name: o.position_m for o in truth.objects}
    lines = [("thing: from the tool, age, confidence, error", ARM)]
    for thing in (*scenario.boxes, *scenario.buttons, *scenario.cylinders):
        seen = next(o for o in percept.objects if o.name == thing.name)
        colour = _colour(seen)
        _draw(drawn, hull(eye.pixels(_body(thing, seen, scenario.table.height_m))), colour, 2 if seen.is_valid else 1)
        if thing.name in true_m:
            _cross(drawn, eye.pixels(np.array([true_m[thing.name]]))[0])
        lines.append((_words(seen, percept, true_m.get(thing.name)), colour))
    for i, button in enumerate(scenario.buttons):
        k = len(percept.distances_m) + i
        state = ("lit" if percept.button_states[i] else "dark") if percept.valid[k] else "unknown"
        lines.append(
            (f"lamp {button.name:14} {state:8} {percept.ages_s[k]:.2f} s", SEEN if percept.valid[k] else UNKNOWN)
        )
    panel = drawn[: FIRST_PX + LINE_PX * len(lines), :PANEL_PX]
    panel //= 3
    for row, (words, colour) in enumerate(lines):
        _write(drawn, words, FIRST_PX + LINE_PX * row, colour)
    return drawn


def _colour(seen: ObjectPercept) -> tuple[int, int, int]:
    if not seen.is_valid:
        return UNKNOWN
    return SEEN if seen.age_s <= FRESH_S else REMEMBERED


def _words(seen: ObjectPercept, percept: Percept, true_m: tuple[float, ...] | None) -> str:
    """Return what is said of one thing: distance from the tool, age, confidence and how far off it is."""
    distance_mm = MM * math.dist(seen.position_m, percept.tcp_position_m)
    said = f"{seen.name:19} d {distance_mm:4.0f} mm  {seen.age_s:5.2f} s  {seen.confidence:4.2f}"
    return said if true_m is None else f"{said}  off {MM * math.dist(seen.position_m, true_m):5.1f} mm"


def _body(thing: Button | Box | Cylinder, seen: ObjectPercept, table_m: float) -> Array:
    """Return points of a thing where it is believed.  -> (n, 3) m"""
    x, y, z = seen.position_m
    if isinstance(thing, Button):
        return cap_points(thing) + np.array([x, y, table_m])
    if isinstance(thing, Box):
        (lx, ly), w = thing.inner_m, thing.wall_m
        rim = [(i * (lx / 2 + w), j * (ly / 2 + w), k) for i in (-1, 1) for j in (-1, 1) for k in (0.0, thing.height_m)]
        return np.array(rim) + np.array([x, y, table_m])
    w, qx, qy, _ = seen.quat
    if w > UPRIGHT_W:
        return standing_points(thing) + np.array([x, y, z - thing.height_m / 2.0])
    return lying_points(thing, math.atan2(-qx, qy)) + np.array([x, y, z - thing.diameter_m / 2.0])


def _large(pixels: Array) -> Array:
    """Return pixels on the larger picture, centres on centres.  (n, 2) -> (n, 2)"""
    return SCALE * pixels + (SCALE - 1) / 2.0


def _draw(drawn: Picture, outline: Array, colour: tuple[int, int, int], width: int) -> None:
    if len(outline) and np.isfinite(outline).all():
        corners = np.round(_large(outline)).astype(np.int32)
        opencv().polylines(drawn, [corners], True, colour, width, opencv().LINE_AA)


def _cross(drawn: Picture, pixel: Array) -> None:
    if np.isfinite(pixel).all():
        u, v = np.round(_large(pixel)).astype(int).tolist()
        opencv().drawMarker(drawn, (u, v), TRUE, opencv().MARKER_CROSS, 12, 1)


def _write(drawn: Picture, words: str, row: int, colour: tuple[int, int, int]) -> None:
    opencv().putText(drawn, words, (10, row), opencv().FONT_HERSHEY_SIMPLEX, TEXT, colour, 1, opencv().LINE_AA)
