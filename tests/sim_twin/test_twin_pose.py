"""A world that stands as another's pose says looks the same; another model's pose is refused."""

import msgspec
import mujoco
import numpy as np
import pytest

from robot.bus.camera_rows import TwinPose
from robot.bus.codec import Codec
from robot.errors import WireError
from robot.layout import draw_layout
from sim_twin.controller.robot import make_world
from sim_twin.render import light_lamps
from sim_twin.twin_pose import pose_of, stand_as


def drawn(world):
    """Return where a world's shapes are drawn, and in which colours."""
    data = mujoco.MjData(world.model)
    mujoco.mj_resetData(world.model, data)
    data.qpos[:] = world.data.qpos
    mujoco.mj_kinematics(world.model, data)
    light_lamps(world)
    return data.geom_xpos.copy(), data.geom_xmat.copy(), world.model.geom_rgba.copy()


def test_another_process_s_world_is_drawn_as_it_stands_with_fixtures_lids_and_lamps():
    one, other = make_world(seed=1), make_world(seed=2)
    one.put(draw_layout(one.scenario, np.random.default_rng(7)), one.arm.home_rad, digital_out=0b101)
    one.advance()
    codec = Codec(TwinPose)
    sent = codec.encode(pose_of(one))
    stand_as(other, codec.decode(sent.payload, sent.beside, has_words=sent.has_words))
    for mine, theirs in zip(drawn(one), drawn(other), strict=True):
        assert np.array_equal(mine, theirs)
    assert not np.array_equal(drawn(other)[0], drawn(make_world(seed=2))[0])


def test_the_pose_of_another_model_is_refused():
    world = make_world()
    pose = pose_of(world)
    for wrong in ({"model_sha256": "0" * 64}, {"qpos": pose.qpos[:-1]}, {"fixtures_m": pose.fixtures_m[:-1]}):
        with pytest.raises(WireError, match="start both with one scenario"):
            stand_as(world, msgspec.structs.replace(pose, **wrong))
