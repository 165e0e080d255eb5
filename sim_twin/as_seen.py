"""A twin that begins where another arm was seen to stand, its table laid out as it was perceived, or as it may be."""

import msgspec
import numpy as np

from robot.layout import Layout, Standing, draw_layout
from robot.messages import ObjectPose, Vec3, Vec6
from sim_twin.plant import TwinWorld
from sim_twin.posing import pose_world

__all__ = ["AsSeen", "Beginning"]


class Beginning(msgspec.Struct, frozen=True, kw_only=True):
    """What was seen of another arm and its table."""

    q_rad: Vec6
    tcp_m: Vec3
    digital_out: int
    opening_m: float
    has_object: bool = False
    things: tuple[ObjectPose, ...] = ()
    """What was perceived of the table. Whatever is not among it is drawn anew at each reset, as the scenario says."""


class AsSeen:
    """Implements robot.hal.protocols.Resetter: each reset begins where things were seen last.

    Args:
        world: the twin.
        seen: what it begins with; `take` stores something newer.
    """

    def __init__(self, world: TwinWorld, seen: Beginning | None = None) -> None:
        self._world, self._seen = world, seen

    def take(self, seen: Beginning) -> None:
        """Store what the next reset brings about."""
        self._seen = seen

    def reset(self, *, seed: int, epoch: int, digital_out: int) -> None:
        """Be, at rest, where the arm is and where things are perceived; what is held stays held."""
        del digital_out  # outputs are as the other table has them
        world, seen = self._world, self._seen
        assert seen is not None, "something was seen before"
        things = {thing.name: (thing.position_m, thing.quat) for thing in seen.things}
        drawn = draw_layout(world.scenario, np.random.default_rng([seed, epoch]))
        fixtures = {name: things[name][0][:2] if name in things else at_m for name, at_m in drawn.fixtures_m.items()}
        standing = {
            name: Standing(position_m=things[name][0][:2], yaw_rad=0.0) if name in things else where
            for name, where in drawn.cylinders.items()
        }
        layout = Layout(fixtures_m=fixtures, cylinders=standing, start_m=seen.tcp_m)
        world.put(layout, seen.q_rad, seen.digital_out)
        pose_world(
            world, q_rad=seen.q_rad, opening_m=seen.opening_m, digital_out=seen.digital_out, things=things
        )  # fmt: skip
        world.opening_asked_m = world.opening_goal_m = 0.0 if seen.has_object else seen.opening_m
        world.grip_set_point[0] = world.opening_asked_m
