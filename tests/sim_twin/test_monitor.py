"""Every kind of breach is brought about on the physics itself and must be seen; just inside the limit it must not."""

import msgspec
import numpy as np
import pytest

from config.limits import ArmPart, KeepOut, Plane
from config.posture import part_points
from sim_twin.allowances import allowances_for
from sim_twin.monitor import Monitor
from sim_twin.perturb import NOMINAL, perturbed_plant
from sim_twin.readings import Reading
from sim_twin.recorder import PartKind, part_kinds
from tests.support.monitor_stage import Stage

replace = msgspec.structs.replace


def test_an_arm_at_rest_breaks_nothing(stage):
    stage.tick(20)
    assert [r for r in stage.judge().values() if r.is_broken] == []


def test_nothing_recorded_is_nothing_judged(stage):
    assert stage.judge() == {}


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize(("beyond", "is_seen"), [(-0.01, False), (0.02, True)])
def test_a_joint_beyond_its_range_is_seen(stage, joint, beyond, is_seen):
    q = stage.data.qpos[:6].copy()
    joints = tuple(
        replace(j, range_rad=(q[i] - 1.0, q[i] + (1.0 if i != joint else -beyond)), soft_margin_rad=0.0)
        for i, j in enumerate(stage.profile.joints)
    )
    stage.tick(3)
    came = stage.judge(replace(stage.profile, joints=joints))["joint_range"]
    assert came.is_broken is is_seen
    assert came.detail == f"#{joint + 1}"


@pytest.mark.parametrize("joint", range(6))
def drive(stage: Stage, joint: int, speed: float, n: int = 90) -> None:
    """Let a joint's set-point run up to a speed gently and on."""
    at = float(stage.data.ctrl[stage.world.joint_controls[joint]])
    for k in range(n):
        at += 0.01 * speed * 0.5 * (1.0 - np.cos(np.pi * min(k / 50, 1.0)))
        stage.data.ctrl[stage.world.joint_controls[joint]] = at
        stage.tick()


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize(("share", "is_seen"), [(0.999, False), (1.01, True)])
def test_a_joint_that_is_too_fast_is_seen(stage, joint, share, is_seen):
    most = stage.profile.joints[joint].speed_rad_s
    drive(stage, joint, share * most, 65)  # before the arm meets anything
    assert stage.judge()["command_speed"].is_broken is is_seen


@pytest.mark.parametrize(("share", "is_seen"), [(1.1, False), (1.3, True)])
def test_a_joint_that_is_faster_than_a_servo_explains_is_seen(stage, share, is_seen):
    drive(stage, 5, share * stage.profile.joints[5].speed_rad_s, 65)
    assert stage.judge()["joint_speed"].is_broken is is_seen


def go(stage: Stage, speeds: list[float], joint: int = 5) -> dict[str, Reading]:
    """Let a joint's set-point go at one speed after another, a tick each, and judge it."""
    control, at = stage.world.joint_controls[joint], float(stage.data.qpos[joint])
    for speed in speeds:
        at += speed * 0.01
        stage.data.ctrl[control] = at
        stage.tick()
    return stage.judge()


def ramp(rate: float, n: int, begin: float = 0.0) -> list[float]:
    return [begin + rate * 0.01 * k for k in range(1, n + 1)]


@pytest.mark.parametrize(("joint", "is_seen"), [(None, True), (4, True), (5, False)])
def test_what_a_drive_at_its_torque_does_is_judged_by_its_set_points_alone(stage, joint, is_seen):
    go(stage, ramp(1.5 * stage.profile.joints[5].acceleration_rad_s2, 12))
    course = stage.recorder.course()
    assert not course.at_torque.any()
    at_torque = course.at_torque.copy()
    if joint is not None:
        at_torque[:, joint] = True
    monitor = Monitor(stage.world, stage.profile, allowances_for(stage.profile, NOMINAL))
    came = {r.limit: r.is_broken for r in monitor.judge(replace(course, at_torque=at_torque))}
    assert came["joint_acceleration"] is is_seen
    assert came["command_acceleration"]


def test_a_drive_at_its_torque_is_known_by_its_force(stage):
    """A stair of 0.1 rad asks wrist 3 for more than it has, one of 1 mrad does not."""
    go(stage, [0.1, 0.1, 0.1])
    assert not stage.recorder.course().at_torque.any()
    go(stage, [10.0])
    assert stage.recorder.course().at_torque.any(axis=0).tolist() == [False] * 5 + [True]


@pytest.mark.parametrize(("share", "is_seen"), [(0.5, False), (1.5, True)])
def test_a_speed_that_changes_too_fast_is_seen(stage, share, is_seen):
    came = go(stage, ramp(share * stage.profile.joints[5].acceleration_rad_s2, 25))
    assert came["command_acceleration"].is_broken is is_seen
    assert came["joint_acceleration"].is_broken is is_seen


@pytest.mark.parametrize(("share", "is_seen"), [(0.999, False), (1.01, True)])
def test_of_set_points_a_gain_beyond_the_acceleration_is_seen_and_a_loss_beyond_a_stops(stage, share, is_seen):
    joint = stage.profile.joints[5]
    gained = go(stage, [0.0, *ramp(share * joint.acceleration_rad_s2, 8)])
    assert gained["command_acceleration"].is_broken is is_seen
    assert not gained["command_stop_acceleration"].is_broken
    stage.lay_out()
    lost = share * joint.stop_acceleration_rad_s2
    came = go(stage, [*ramp(4.0, 20), *ramp(-lost, 3, 0.8)])
    assert came["command_stop_acceleration"].is_broken is is_seen
    assert not came["command_acceleration"].is_broken


@pytest.mark.parametrize(("share", "is_seen"), [(0.999, False), (1.01, True)])
def test_of_set_points_a_gain_that_grows_too_fast_is_seen_and_a_change_beyond_a_stops(stage, share, is_seen):
    joint = stage.profile.joints[5]
    grown = go(stage, [*[0.0] * 4, *ramp(share * joint.jerk_rad_s3 * 0.01, 5)])
    assert grown["command_jerk"].is_broken is is_seen
    assert not grown["command_stop_jerk"].is_broken
    stage.lay_out()
    came = go(stage, [*ramp(4.0, 20), *ramp(4.0 - share * joint.stop_jerk_rad_s3 * 0.01, 3, 0.8)])
    assert came["command_stop_jerk"].is_broken is is_seen
    assert not came["command_jerk"].is_broken


def test_turning_round_at_a_steady_acceleration_is_no_jerk(stage):
    came = go(stage, [*ramp(-4.0, 20, 0.33)])
    assert not came["command_jerk"].is_broken
    assert came["command_jerk"].value < 1.0


@pytest.mark.parametrize(("name", "key"), [("tcp", "tcp_m_s"), ("flange", "flange_m_s"), ("elbow", "elbow_m_s")])
def test_the_speed_that_a_set_point_asks_of_a_point_is_held_to_the_limit(stage, name, key):
    drive(stage, 0, 0.5, 60)
    asked = stage.judge()[f"command_{name}_speed"].value
    place = {"tcp": 0, "flange": 1, "elbow": 2}[name]
    radius = np.linalg.norm(stage.recorder.course().position_m[0, place, :2])
    assert asked == pytest.approx(0.5 * radius, rel=1e-3)
    for share, is_seen in ((1.001, False), (0.99, True)):
        speeds = replace(stage.profile.speeds, **{key: share * asked})
        assert stage.judge(replace(stage.profile, speeds=speeds))[f"command_{name}_speed"].is_broken is is_seen


def test_a_set_point_that_jumps_is_seen_though_the_joint_lags(stage):
    stage.tick(3)
    stage.data.ctrl[stage.world.joint_controls[0]] += 0.011
    stage.tick(3)
    came = stage.judge()
    assert came["command_speed"].is_broken
    assert came["command_jerk"].is_broken


@pytest.mark.parametrize(("name", "key"), [("tcp", "tcp_m_s"), ("flange", "flange_m_s"), ("elbow", "elbow_m_s")])
def test_the_speed_of_a_point_is_the_physics_own(stage, name, key):
    drive(stage, 0, 0.5, 60)
    course = stage.recorder.course()
    place = {"tcp": 0, "flange": 1, "elbow": 2}[name]
    moved = np.diff(course.position_m[:, place], axis=0) / course.physics_s
    assert course.speed_m_s[1:, place] == pytest.approx(np.linalg.norm(moved, axis=1), abs=0.006)
    fastest = float(course.speed_m_s[:, place].max())
    for share, is_seen in ((0.9, False), (0.75, True)):
        speeds = replace(stage.profile.speeds, **{key: share * fastest})
        assert stage.judge(replace(stage.profile, speeds=speeds))[f"{name}_speed"].is_broken is is_seen


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1, 1])
def test_a_tool_outside_a_box_is_seen(stage, axis, side):
    stage.tick(3)
    at = stage.recorder.course().position_m[-1, 0]
    for off, is_seen in ((0.003, False), (-0.003, True)):
        low, high = at - 0.1, at + 0.1
        (low if side < 0 else high)[axis] = at[axis] + side * off
        (box,) = stage.profile.workspace.boxes
        box = replace(box, low_m=tuple(low), high_m=tuple(high))
        space = replace(stage.profile.workspace, boxes=(box,))
        came = stage.judge(replace(stage.profile, workspace=space))[f"box:{box.name}"]
        assert came.is_broken is is_seen


@pytest.mark.parametrize("part", list(ArmPart))
def test_each_part_of_the_arm_is_held_by_planes_and_keep_outs(stage, part):
    stage.tick(3)
    at = stage.recorder.course().position_m[-1, {"tcp": 0, "flange": 1, "elbow": 2}[part]]
    for off, is_seen in ((0.003, False), (-0.003, True)):
        place = (float(at[0]), float(at[1]), float(at[2]) - off)
        ball = (place[0], place[1], place[2] - 0.1)
        space = replace(
            stage.profile.workspace,
            planes=(Plane(name="here", point_m=place, normal=(0.0, 0.0, 2.0), parts=(part,)),),
            keep_outs=(KeepOut(name="ball", low_m=ball, high_m=ball, radius_m=0.1, parts=(part,)),),
        )
        came = stage.judge(replace(stage.profile, workspace=space))
        assert came["plane:here"].is_broken is is_seen
        assert came["keep_out:ball"].is_broken is is_seen


@pytest.mark.parametrize(("tilt", "is_seen"), [(0.75, False), (0.82, True)])
def test_a_tool_tilted_out_of_its_cone_is_seen(stage, tilt, is_seen):
    q = stage.data.qpos[:6].copy()
    q[3] += tilt
    stage.put(q)
    stage.tick(3)
    came = stage.judge()["tool_cone"]
    assert came.value == pytest.approx(tilt, abs=0.01)
    assert came.is_broken is is_seen


@pytest.mark.parametrize(("off", "is_seen"), [(-0.0005, False), (0.003, True)])
def test_a_clearance_is_the_physics_own_distance(stage, off, is_seen):
    stage.tick(3)
    near = stage.judge()["scene_clearance"].value
    clearances = replace(stage.profile.clearances, scene_m=near + off)
    assert stage.judge(replace(stage.profile, clearances=clearances))["scene_clearance"].is_broken is is_seen


@pytest.mark.parametrize(("off", "is_seen"), [(-0.0005, False), (0.002, True)])
def test_a_set_point_too_near_to_something_is_seen_though_the_arm_is_not_there(stage, off, is_seen):
    stage.tick(2)
    before = stage.judge()["scene_clearance"].value
    stage.data.ctrl[stage.world.joint_controls[1]] += 0.45  # hand and wrist far down, which takes longer than a tick
    stage.tick()
    came = stage.judge()
    asked_m = came["command_scene_clearance"].value
    assert asked_m < before - 0.005 < came["scene_clearance"].value
    held = replace(stage.profile.clearances, scene_m=max(asked_m + off, 1e-3))
    assert stage.judge(replace(stage.profile, clearances=held))["command_scene_clearance"].is_broken is is_seen


def test_an_arm_folded_into_itself_is_seen_though_the_physics_lets_it_through(stage):
    q = stage.data.qpos[:6].copy()
    q[2], q[3] = 2.9, 0.0
    stage.put(q)
    stage.tick(1)
    came = stage.judge()["self_clearance"]
    assert came.is_broken
    assert came.value < 0.0


@pytest.mark.parametrize("towards", [-1.0, 1.0])
@pytest.mark.parametrize(("gap", "share"), [(0.15, 0.775), (0.02, 0.19)])
def test_a_set_point_in_a_soft_margin_is_held_to_what_is_left_of_its_speed(stage, towards, gap, share):
    """A tenth of 1 rad/s at the end and all of it 0.2 rad before: 0.1 + 0.9 gap / 0.2."""
    at = float(stage.data.qpos[5])
    ends = (at - gap - 0.5, at + gap) if towards > 0 else (at - gap, at + gap + 0.5)
    joints = (*stage.profile.joints[:5], replace(stage.profile.joints[5], range_rad=ends, soft_margin_rad=0.2))
    profile = replace(stage.profile, joints=joints)
    for part, way, is_seen in ((1.01, 1.0, True), (0.99, 1.0, False), (1.01, -1.0, False)):
        stage.lay_out()
        for here in (at - way * towards * part * share * 0.01, at):
            stage.data.ctrl[stage.world.joint_controls[5]] = here
            stage.tick()
        assert stage.judge(profile)["command_soft_margin"].is_broken is is_seen


def test_a_stop_is_timed_and_measured_to_rest(stage):
    drive(stage, 0, 0.9)
    stage.plant.arm.stop()
    stage.tick(40)
    came = stage.judge()
    assert 0.03 < came["stop_time"].value < 0.2
    assert 0.005 < came["stop_distance"].value < 0.1
    stopping = replace(stage.profile.stopping, time_s=0.9 * came["stop_time"].value)
    assert stage.judge(replace(stage.profile, stopping=stopping))["stop_time"].is_broken
    stopping = replace(stage.profile.stopping, distance_m=0.9 * came["stop_distance"].value)
    assert stage.judge(replace(stage.profile, stopping=stopping))["stop_distance"].is_broken


def test_every_solid_thing_of_the_scene_has_a_kind(stage):
    model, kinds = stage.world.model, part_kinds(stage.world)
    solid = [k for i, k in enumerate(kinds) if model.geom_contype[i] or model.geom_conaffinity[i]]
    assert PartKind.OTHER not in solid
    assert set(PartKind) - {PartKind.OTHER} == set(solid)


def test_recording_changes_nothing_of_the_physics(resolved, stage):
    plain = perturbed_plant(resolved, NOMINAL)
    plain.arm.connect()
    plain.resetter.reset(seed=0, epoch=0, digital_out=0)
    for world in (plain.world, stage.world):
        world.data.ctrl[world.joint_controls[0]] += 0.05
        for _ in range(20):
            world.advance()
    assert (plain.world.data.qpos == stage.data.qpos).all()


def test_the_elbow_is_where_the_files_say_it_is_and_not_beside_the_arm(stage):
    stage.tick(1)
    course = stage.recorder.course()
    expected = part_points(stage.world.arm, course.q_rad[0])[ArmPart.ELBOW]
    assert course.position_m[1, 2] == pytest.approx(expected, abs=1e-6)
