import itertools
import math

import numpy as np
import pytest

from config.limited import limited
from config.loader import load_arm
from robot.description import forward_kinematics, tool_down
from robot.kinematics import Kinematics
from robot.motion.follower import Follower
from tests.support.profiles import envelope, open_envelope, profile

ARM = load_arm("ur5e")
DT, FAST_DT = 0.01, 0.002
KINEMATICS = Kinematics(ARM)
START = (0.42, 0.0, 0.2)
Q_START = KINEMATICS.solve(START, ARM.home_rad)
LOW, HIGH = (np.array(corner) for corner in ARM.motion.workspace_m)


@pytest.fixture
def follower():
    made = Follower(ARM, envelope=envelope(DT), tick_s=DT)
    made.seed(Q_START)
    return made


def run(follower, n):
    return [follower.step() for _ in range(n)]


def tcps(path):
    return np.array([KINEMATICS.tcp(q) for q in path])


def test_seeded_it_rests_where_it_is(follower):
    assert np.allclose(run(follower, 20), Q_START, atol=1e-5)
    assert follower.target_m == pytest.approx(START, abs=1e-5)


def test_the_tool_goes_straight_stays_upright_and_rests_on_the_target(follower):
    target = (0.47, 0.06, 0.12)
    follower.aim(target, ARM.tool_yaw_rad)
    path = run(follower, 150)
    points = tcps(path)
    along = np.subtract(target, START) / math.dist(target, START)
    off = (points - START) - np.outer((points - START) @ along, along)
    assert np.linalg.norm(off, axis=1).max() < 1e-4
    assert ((points - START) @ along).max() <= math.dist(target, START) + 1e-4
    assert points[-1] == pytest.approx(target, abs=1e-5)
    for q in path[::10]:
        assert np.allclose(forward_kinematics(ARM, q)[:3, :3], tool_down(ARM.tool_yaw_rad), atol=1e-4)


def test_at_a_real_arms_ticks_the_way_is_the_same_and_begins_one_tick_later():
    rng = np.random.default_rng(1)
    now, later = (
        Follower(ARM, envelope=envelope(FAST_DT), tick_s=FAST_DT),
        Follower(ARM, envelope=envelope(FAST_DT), tick_s=FAST_DT),
    )
    now._is_swift = False
    for follower in (now, later):
        follower.seed(Q_START)
    expected, path = [now.step()], []
    for _ in range(20):
        target = tuple((START + rng.uniform(-0.03, 0.03, 3)).tolist())
        for follower in (now, later):
            follower.aim(target, ARM.tool_yaw_rad)
            assert follower.target_m == target
        expected += run(now, 25)
        path += run(later, 25)
    assert path == expected[:-1]
    assert max(math.dist(a, b) for a, b in itertools.pairwise(path)) > 1e-4


def test_targets_that_come_every_tick_are_gone_to_and_a_brake_waits_for_nothing():
    follower = Follower(ARM, envelope=envelope(FAST_DT), tick_s=FAST_DT)
    follower.seed(Q_START)
    for i in range(200):
        follower.aim((START[0] + 1e-4 * i, *START[1:]), ARM.tool_yaw_rad)
        follower.step()
    assert KINEMATICS.tcp(follower.q_rad)[0] > START[0] + 0.01
    follower.aim((START[0], START[1] + 0.05, START[2]), ARM.tool_yaw_rad)
    follower.brake()
    path = tcps(run(follower, 300))
    assert path[-1] == pytest.approx(follower.target_m, abs=1e-5)
    assert abs(path[-1][1] - START[1]) < 1e-4


def test_joints_keep_their_speeds_and_accelerations_over_random_targets():
    rng = np.random.default_rng(0)
    follower = Follower(ARM, envelope=envelope(DT), tick_s=DT)
    speed_max, acceleration_max = np.zeros(6), np.zeros(6)
    for _ in range(30):
        follower.seed(KINEMATICS.solve(tuple(rng.uniform(LOW, HIGH).tolist()), ARM.home_rad))
        path = []
        for _ in range(20):
            step = rng.normal(size=3)
            target = np.clip(follower.target_m + 0.022 * step / np.linalg.norm(step), LOW, HIGH)
            follower.aim(tuple(target.tolist()), ARM.tool_yaw_rad)
            path += run(follower, 5)
        speed = np.diff(path, axis=0) / DT
        speed_max = np.maximum(speed_max, np.abs(speed).max(0))
        acceleration_max = np.maximum(acceleration_max, np.abs(np.diff(speed, axis=0) / DT).max(0))
    assert (speed_max <= [j.speed_rad_s for j in ARM.joints]).all()
    assert (acceleration_max <= [j.acceleration_rad_s2 for j in ARM.joints]).all()


def test_near_the_base_the_tool_is_held_back_so_that_no_joint_is_too_fast():
    # Here a metre a second of the tool is more than the base joint may do.
    follower = Follower(ARM, envelope=open_envelope(DT), tick_s=DT)
    follower.seed(KINEMATICS.solve((0.16, -0.1, 0.25), ARM.home_rad))
    follower.aim((0.16, 0.1, 0.25), ARM.tool_yaw_rad)
    path = run(follower, 150)
    speed = np.abs(np.diff(path, axis=0) / DT).max(0)
    assert (speed <= [j.speed_rad_s for j in ARM.joints]).all()
    assert speed[0] > 0.9 * ARM.joints[0].speed_rad_s
    assert tcps(path)[-1] == pytest.approx((0.16, 0.1, 0.25), abs=1e-4)


def test_joint_targets_are_reached_and_the_tool_can_go_on_from_there(follower):
    elsewhere = KINEMATICS.solve((0.5, 0.1, 0.25), ARM.home_rad)
    follower.aim(START, ARM.tool_yaw_rad)
    follower.aim_joints(elsewhere)
    assert run(follower, 200)[-1] == pytest.approx(elsewhere, abs=1e-6)
    follower.aim((0.52, 0.1, 0.25), ARM.tool_yaw_rad)
    assert tcps(run(follower, 100))[-1] == pytest.approx((0.52, 0.1, 0.25), abs=1e-4)


def test_taking_up_joints_in_motion_makes_no_jump(follower):
    follower.aim((0.5, 0.1, 0.2), ARM.tool_yaw_rad)
    path = run(follower, 20)
    follower.aim_joints(Q_START)
    path += run(follower, 100)
    acceleration = np.abs(np.diff(np.diff(path, axis=0) / DT, axis=0) / DT)
    assert (acceleration.max(0) <= np.array([j.acceleration_rad_s2 for j in ARM.joints]) * 1.01).all()


def test_a_tilted_tool_is_brought_upright_in_bounded_steps():
    follower = Follower(ARM, envelope=envelope(DT), tick_s=DT)
    tilted = (*Q_START[:4], Q_START[4] + 0.6, Q_START[5])
    follower.seed(tilted)
    path = [tilted]
    for _ in range(20):
        assert follower.aim(START, ARM.tool_yaw_rad)
        path += run(follower, 5)
    path += run(follower, 60)
    assert (np.abs(np.diff(path, axis=0) / DT).max(0) <= [j.speed_rad_s for j in ARM.joints]).all()
    assert np.allclose(forward_kinematics(ARM, path[-1])[:3, :3], tool_down(ARM.tool_yaw_rad), atol=1e-4)
    assert tcps(path)[-1] == pytest.approx(START, abs=1e-4)


def test_an_unreachable_place_brings_the_arm_to_rest_and_says_so():
    follower = Follower(ARM, envelope=open_envelope(DT), tick_s=DT)
    follower.seed(Q_START)
    follower.aim((1.3, 0.0, 0.2), ARM.tool_yaw_rad)
    troubles, path = [], []
    for _ in range(400):
        path.append(follower.step())
        troubles.append(follower.trouble)
    assert "unreachable" in troubles
    assert np.abs(np.subtract(path[-1], path[-2])).max() < 1e-9
    assert (np.abs(np.diff(path, axis=0) / DT).max(0) <= [j.speed_rad_s for j in ARM.joints]).all()


def test_braking_rests_soon_and_the_target_says_where(follower):
    follower.aim((0.55, 0.0, 0.2), ARM.tool_yaw_rad)
    run(follower, 25)
    here = KINEMATICS.tcp(follower.q_rad)
    follower.brake()
    assert tcps(run(follower, 100))[-1] == pytest.approx(follower.target_m, abs=1e-5)
    assert 0.001 < math.dist(here, follower.target_m) < 0.06


def test_seeding_forgets_everything_before(follower):
    fresh = Follower(ARM, envelope=envelope(DT), tick_s=DT)
    follower.aim((0.5, 0.1, 0.3), 0.4)
    run(follower, 33)
    follower.seed(Q_START)
    fresh.seed(Q_START)
    for each in (follower, fresh):
        each.aim((0.44, 0.0, 0.2), ARM.tool_yaw_rad)
    assert run(follower, 40) == run(fresh, 40)


@pytest.mark.parametrize("name", ["attended", "unattended"])
def test_joints_go_to_others_nearly_as_fast_as_the_parts_may_and_no_faster_without_being_held_back(name):
    held = envelope(DT, name)
    follower = Follower(limited(ARM, profile(name)), envelope=held, tick_s=DT)
    follower.seed(Q_START)
    follower.aim_joints((Q_START[0] + 0.5, Q_START[1] + 0.2, Q_START[2] - 0.2, *Q_START[3:]))
    fastest, is_held = 0.0, False
    before = follower.points(Q_START)[0]
    for q in (follower.step() for _ in range(300)):
        points = follower.points(q)[0]
        shares = [math.dist(a, b) / m for a, b, m in zip(before, points, held.part_step_m, strict=True)]
        fastest, is_held, before = max(fastest, *shares), is_held or follower.held is not None, points
    assert not is_held
    assert fastest <= 1.0
    assert name == "unattended" or fastest > 0.75
