"""Fingers, what they touch and what is asked of them: each breach brought about on the physics and seen."""

import msgspec
import pytest

from config.limits import Touched
from sim_twin.contacts import pressing_n
from sim_twin.names import on_table
from sim_twin.recorder import PartKind, Touch
from tests.support.monitor_stage import Stage

replace = msgspec.structs.replace


def press(stage: Stage, name: str, depth_m: float = 0.004) -> None:
    """Bring the fingertips down on a thing, straight."""
    x, y, z = stage.data.xpos[stage.world.model.body(on_table(name)).id]
    top = next(t.height_m for t in (*stage.world.scenario.buttons, *stage.world.scenario.boxes) if t.name == name)
    kinematics = stage.plant.resetter._kinematics
    over = (float(x), float(y), float(z) + top + 0.015 - depth_m)
    stage.put(kinematics.solve(over, stage.world.arm.home_rad))


def test_fingers_on_a_button_are_allowed_and_without_the_pair_a_breach(stage):
    press(stage, "green_button")
    stage.tick(10)
    assert not stage.judge()["contact_pair"].is_broken
    contacts = tuple(c for c in stage.profile.contacts if c.thing is not Touched.BUTTON)
    came = stage.judge(replace(stage.profile, contacts=contacts))
    assert came["contact_pair"].is_broken
    assert "fingers on table/green_button" in came["contact_pair"].detail
    assert came["scene_clearance"].is_broken


def test_the_force_of_a_pair_is_the_physics_own(stage):
    press(stage, "green_button")
    stage.tick(10)
    pushed = stage.judge()["force:fingers-button"].value
    assert pushed > 1.0
    for share, is_seen in ((1.01, False), (0.98, True)):
        contacts = tuple(replace(c, force_n=share * pushed) for c in stage.profile.contacts)
        assert stage.judge(replace(stage.profile, contacts=contacts))["force:fingers-button"].is_broken is is_seen


def test_a_force_that_lasts_is_told_from_a_blow(stage):
    press(stage, "green_button")
    stage.tick(10)
    came = stage.judge()
    assert came["blow"].value >= came["steady_force"].value > 1.0
    force = replace(stage.profile.contact_force, steady_n=0.9 * came["steady_force"].value)
    assert stage.judge(replace(stage.profile, contact_force=force))["steady_force"].is_broken
    force = replace(stage.profile.contact_force, blow_n=0.9 * came["blow"].value)
    assert stage.judge(replace(stage.profile, contact_force=force))["blow"].is_broken


def test_fingers_on_the_bare_table_are_a_breach(stage):
    kinematics = stage.plant.resetter._kinematics
    stage.put(kinematics.solve((0.42, 0.1, 0.013), stage.world.arm.home_rad))
    stage.tick(5)
    came = stage.judge()
    assert came["contact_pair"].is_broken
    assert came["contact_pair"].detail == "fingers on world"


def test_friction_counts_as_a_push_on_the_arm(stage):
    press(stage, "green_button")
    stage.tick(10)
    course = stage.recorder.course()
    touch = max(course.touches, key=lambda t: t.force_n)
    plain = pressing_n(course)[touch.step]
    side = replace(touch, force_n=0.0, vector_n=(300.0, -400.0, 0.0))
    assert pressing_n(replace(course, touches=(side,)))[touch.step] == pytest.approx(500.0)
    assert plain >= touch.force_n * 0.999


def test_a_squeeze_counts_although_it_pushes_nowhere(stage):
    stage.tick(3)
    course = stage.recorder.course()
    pair = [Touch(4, PartKind.FINGERS, PartKind.OBJECT, "a", 50.0, (sign * 50.0, 0.0, 0.0)) for sign in (-1.0, 1.0)]
    force = pressing_n(replace(course, touches=tuple(pair)))
    assert force[4] == pytest.approx(100.0)
    assert force.sum() == force[4]


@pytest.mark.parametrize(("speed", "is_seen"), [(0.14, False), (0.16, True)])
def test_fingers_that_are_too_fast_are_seen(stage, speed, is_seen):
    stage.world.opening_goal_m, stage.world.grip_speed_m_s = 0.0, speed
    stage.tick(40)
    assert stage.judge()["grip_speed"].is_broken is is_seen


def test_a_hand_that_presses_too_hard_is_seen(stage):
    stage.world.limit_grip(300.0)
    stage.data.ctrl[stage.world.grip_control] = 0.0
    stage.world.opening_asked_m = stage.world.opening_goal_m = 0.0
    stage.tick(1)
    assert stage.judge()["grip_force"].is_broken


@pytest.mark.parametrize(("force_n", "is_seen"), [(19.9, True), (20.0, False), (235.0, False), (236.0, True)])
def test_a_force_that_is_asked_of_the_hand_is_held_to_both_ends_though_nothing_is_gripped(stage, force_n, is_seen):
    stage.world.limit_grip(force_n)
    stage.tick(3)
    came = stage.judge()["command_grip_force"]
    assert came.is_broken is is_seen
    assert came.value == force_n


@pytest.mark.parametrize(("speed", "is_seen"), [(0.0199, True), (0.02, False), (0.15, False), (0.151, True)])
def test_a_speed_that_is_asked_of_a_hand_that_moves_is_held_to_both_ends(stage, speed, is_seen):
    stage.world.grip_speed_m_s = speed
    stage.tick(3)
    assert not stage.judge()["command_grip_speed"].is_broken  # it rests
    stage.world.opening_goal_m = 0.05
    stage.tick(3)
    assert stage.judge()["command_grip_speed"].is_broken is is_seen


def test_fingers_wider_than_allowed_are_seen(stage):
    stage.tick(3)
    grip = replace(stage.profile.grip, opening_m=(0.0, 0.08))
    assert stage.judge(replace(stage.profile, grip=grip))["grip_opening"].is_broken
    assert not stage.judge()["grip_opening"].is_broken
