"""Draws arm and table of a session as they were measured and perceived. Looks only: no physics is run."""

from collections.abc import Iterator
from contextlib import contextmanager

from config.resolved import Resolved
from robot.messages import ArmState, Percept
from robot.recording.errors import UnfitError
from robot.recording.film import Draws
from sim_twin.plant import TwinPlant
from sim_twin.posing import pose_world
from sim_twin.render import NoGLError, Picture, open_renderer, render
from sim_twin.shadow import mirrored

__all__ = ["open_drawer"]

SIZE_PX = (960, 720)


@contextmanager
def open_drawer(resolved: Resolved) -> Iterator[Draws]:
    """Give what draws an arm at its table.

    Args:
        resolved: what the session was recorded with, on whatever rig.

    Raises:
        UnfitError: nothing can be drawn on this machine.
    """
    mirror = mirrored(resolved)
    world = TwinPlant(arm=mirror.arm, scenario=mirror.scenario, rig=mirror.rig).world

    def draw(state: ArmState, percept: Percept) -> Picture:
        things = {t.name: (t.position_m, t.quat) for t in percept.objects if any(t.quat)}
        pose_world(
            world, q_rad=state.q_rad, opening_m=state.grip.opening_m, digital_out=state.digital_out, things=things
        )
        return render(world, renderer)

    try:
        with open_renderer(world, width=SIZE_PX[0], height=SIZE_PX[1]) as renderer:
            yield draw
    except NoGLError as error:
        raise UnfitError(f"a video: {error}") from error
