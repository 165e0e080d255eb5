import mujoco
import numpy as np
import pytest

from config.arm import ArmConfig
from config.loader import load_arm, load_rig, load_scenario
from robot.description import arm_model, forward_kinematics
from robot.servo import lag_s
from sim_twin.plant import TwinPlant


@pytest.fixture(scope="module")
def arm() -> ArmConfig:
    return load_arm("ur5e")


def test_the_model_agrees_with_the_published_denavit_hartenberg_table(arm):
    model = arm_model(arm)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(7)
    for _ in range(200):
        q = rng.uniform(-np.pi, np.pi, 6)
        data.qpos[:6] = q
        mujoco.mj_kinematics(model, data)
        for frame in ("tcp", "flange"):
            T = forward_kinematics(arm, q, frame=frame)
            np.testing.assert_allclose(data.site(frame).xpos, T[:3, 3], atol=1e-9)
            np.testing.assert_allclose(data.site(frame).xmat.reshape(3, 3), T[:3, :3], atol=1e-9)


def test_straight_up_the_flange_is_where_the_makers_lengths_add_up(arm):
    # By hand: upper arm and forearm upright, 162.5 + 425 + 392.2 + 99.7 mm high, 133.3 + 99.6 mm to the side.
    T = forward_kinematics(arm, (0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0), frame="flange")
    np.testing.assert_allclose(T[:3, 3], (0.0, -0.2329, 1.0794), atol=1e-9)


def test_the_moving_mass_is_the_makers(arm):
    model = arm_model(arm)
    links = sum(float(model.body(f"link_{i}").mass[0]) for i in range(1, 7))
    assert links == pytest.approx(17.7, abs=0.01)


@pytest.fixture(scope="module")
def plant(arm) -> TwinPlant:
    return TwinPlant(arm=arm, scenario=load_scenario("paper"), rig=load_rig("twin"))


def test_the_arm_droops_less_than_half_a_millimetre(plant, arm):
    plant.resetter.reset(seed=0, epoch=0, digital_out=0)
    world = plant.world
    q_rad = arm.home_rad
    world.data.qpos[:6] = q_rad
    world.data.ctrl[world.joint_controls] = q_rad
    world.data.body("tool").xfrc_applied[2] = -0.45 * 9.81  # the heaviest cylinder in the hand
    for _ in range(300):
        world.advance()
    droop = forward_kinematics(arm, q_rad)[:3, 3] - world.data.site("tcp").xpos
    world.data.body("tool").xfrc_applied[2] = 0.0
    assert 0.0 < np.linalg.norm(droop) < 0.0005


def test_the_arm_trails_a_moving_target_by_the_servo_law(plant, arm):
    plant.resetter.reset(seed=0, epoch=0, digital_out=0)
    world, speed = plant.world, 0.3
    q_rad = np.array(world.data.qpos[:6])
    for k in range(100):
        world.data.ctrl[world.joint_controls[0]] = q_rad[0] + speed * k * world.tick_s
        world.advance()
    asked = q_rad[0] + speed * 100 * world.tick_s
    measured_lag_s = (asked - world.data.qpos[0]) / speed
    servo = arm.servo
    law_s = lag_s(lookahead_s=servo.lookahead_s, gain=servo.gain, dead_time_s=servo.dead_time_s)
    assert measured_lag_s == pytest.approx(law_s, abs=0.002)


def test_the_servo_law_meets_its_anchor():
    assert lag_s(lookahead_s=0.03, gain=1200.0, dead_time_s=0.003) == pytest.approx(0.034)


def test_nothing_is_welded(plant):
    assert set(plant.world.model.eq_type) == {int(mujoco.mjtEq.mjEQ_JOINT)}
