"""Pictures of the twin: off-screen rendering with lit lamps, where a GL can be had."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from sim_twin.names import on_table
from sim_twin.plant import TwinWorld

__all__ = ["HOW_TO_DRAW", "NoGLError", "Picture", "Viewpoint", "light_lamps", "open_renderer", "render"]

Picture = NDArray[np.uint8]
HOW_TO_DRAW = (
    "Set MUJOCO_GL=egl (Debian: apt install libegl1 libgl1-mesa-dri) or MUJOCO_GL=osmesa (apt install libosmesa6) "
    "before the program starts."
)
BACKENDS = ("egl", "osmesa")
GLOW = 0.55
LOOKED_AT_M = (0.30, 0.0, 0.22)
"""What a viewpoint has in the middle of its picture, base frame: between the arm and the things on the table."""


class Viewpoint(msgspec.Struct, frozen=True, kw_only=True):
    """Where a picture is taken from, as seen from the middle of what it shows."""

    bearing_deg: float
    """Direction of the camera in the plane, base frame: 0 in front of the arm, 90 on its left."""
    elevation_deg: float
    """How far above the horizon the camera is."""
    distance_m: float

    def camera(self) -> mujoco.MjvCamera:
        """Return it as MuJoCo has it, which tells where a camera looks to and not where it is."""
        camera = mujoco.MjvCamera()
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        camera.lookat[:] = LOOKED_AT_M
        camera.azimuth = math.remainder(self.bearing_deg + 180.0, 360.0)
        camera.elevation = -self.elevation_deg
        camera.distance = self.distance_m
        return camera


class NoGLError(RuntimeError):
    """No way to draw off-screen on this machine."""


@contextmanager
def open_renderer(world: TwinWorld, *, width: int = 1280, height: int = 960) -> Iterator[mujoco.Renderer]:
    """Give an off-screen renderer of a world.

    Raises:
        NoGLError: neither EGL nor OSMesa works here; the message says what to install.
    """
    try:
        renderer = mujoco.Renderer(world.model, height, width)
    except (ImportError, AttributeError, RuntimeError, mujoco.FatalError) as error:
        backend = os.environ.get("MUJOCO_GL", "unset")
        raise NoGLError(
            f"expected an off-screen GL, MUJOCO_GL is {backend}, it said: {error}. {HOW_TO_DRAW}"
        ) from error
    try:
        yield renderer
    finally:
        renderer.close()


def render(world: TwinWorld, renderer: mujoco.Renderer, *, viewpoint: Viewpoint | None = None) -> Picture:
    """Draw the world as it stands, lamps lit as the outputs say.  -> (height, width, 3) uint8

    Args:
        world: what to draw.
        renderer: what to draw with.
        viewpoint: where to look from; None takes the scene's own overview.
    """
    light_lamps(world)
    option = mujoco.MjvOption()
    option.sitegroup[:] = 0
    option.geomgroup[:] = (1, 1, 1, 0, 0, 0)
    renderer.update_scene(world.data, "overview" if viewpoint is None else viewpoint.camera(), option)
    return renderer.render()


def light_lamps(world: TwinWorld) -> None:
    """Colour each dome bright where its lamp is lit, dull where it is not. Looks only."""
    for button in world.scenario.buttons:
        is_lit = bool(world.digital_out >> button.lamp_output & 1)
        colour = np.asarray(button.colour)
        shown = colour + (1.0 - colour) * GLOW if is_lit else colour * 0.8
        world.model.geom(on_table(button.name, "dome")).rgba[:3] = shown
        world.model.geom(on_table(button.name, "cap")).rgba[:3] = shown * 0.9
