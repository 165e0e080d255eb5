"""How a twin's world stands, as a message and back: what is drawn in another process is drawn of the same world."""

from robot.bus.camera_rows import TwinPose
from robot.errors import WireError
from sim_twin.names import on_table
from sim_twin.plant import TwinWorld

__all__ = ["pose_of", "stand_as"]


def pose_of(world: TwinWorld) -> TwinPose:
    """Return how a world stands now."""
    model = world.model
    fixtures = [model.body(name).pos for name in _fixtures(world)]
    return TwinPose(
        model_sha256=world.model_sha256, qpos=tuple(world.data.qpos.tolist()),
        fixtures_m=tuple([(float(at[0]), float(at[1])) for at in fixtures]), digital_out=world.digital_out,
    )  # fmt: skip


def stand_as(world: TwinWorld, pose: TwinPose) -> None:
    """Have a world of one's own stand as another does. Only what is drawn is right then: nothing is reckoned.

    Raises:
        WireError: the other is of another model.
    """
    fixtures = _fixtures(world)
    if (
        pose.model_sha256 != world.model_sha256
        or len(pose.qpos) != world.model.nq
        or len(pose.fixtures_m) != len(fixtures)
    ):
        raise WireError(
            f"expected the twin's world to be of model {world.model_sha256[:12]} as here, came "
            f"{pose.model_sha256[:12]}: start both with one scenario and one arm's file"
        )
    for name, at in zip(fixtures, pose.fixtures_m, strict=True):
        world.model.body(name).pos[:2] = at
    world.data.qpos[:] = pose.qpos
    world.digital_out = pose.digital_out


def _fixtures(world: TwinWorld) -> list[str]:
    """Return the bodies that only a reset moves."""
    scenario = world.scenario
    return [on_table(thing.name) for thing in (*scenario.buttons, *scenario.boxes)]
