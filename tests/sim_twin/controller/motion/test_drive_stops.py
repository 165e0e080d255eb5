"""What stops a drive, and where the arm is then: contacts, limits, planes, what a controller's modes ask."""

import msgspec
import numpy as np
import pytest

from sim_twin.controller.modes import Event, Modes, PowerTimes, RobotMode, RuntimeState
from sim_twin.controller.motion.contact import ContactWatch
from sim_twin.controller.motion.limits import Cause, Plane
from tests.support.motion_bench import HOME, idle, make_drive, over_the_table, play

X = np.array([1.0, 0, 0, 0, 0, 0])


def test_contact_is_found_and_dated():
    drive = make_drive()
    over_the_table(drive, 0.03)
    watch, motion, seen = ContactWatch(), drive.motions.speeds.speedl((0, 0, -0.03, 0, 0, 0), 0.5, 5.0), []
    for _ in motion:
        assert drive.tick() is None
        watch.push(drive.measured.wrench[:3], drive.measured.tcp_speed[:3])
        seen.append(drive.measured.wrench[2])
        if watch.slices_since_contact(np.array([0, 0, -1.0])) >= 5:
            break
    assert watch.slices_since_contact() >= 5, "without a direction: along the last motion"
    assert watch.slices_since_contact(np.array([0, 0, 1.0])) == 0
    assert seen[-6] < 12.0 <= seen[-5]


def test_the_watch_counts_back_to_the_last_slice_without_contact_whatever_came_before():
    rng = np.random.default_rng(5)
    watch, felt, way = ContactWatch(n_slices=50), [], np.array([0.3, -0.2, -2.0])
    assert watch.slices_since_contact(way) == 0
    lasts = np.repeat(rng.random(60) < 0.5, rng.integers(1, 80, 60))
    for is_met in lasts:
        against = rng.uniform(12.01, 40.0) if is_met else rng.uniform(-40.0, 11.99)
        felt.append(is_met)
        watch.push(-against * way / np.linalg.norm(way) + np.array([0.0, 5.0, -0.5]), way)
        free = [k for k, was_met in enumerate(reversed(felt[-50:])) if not was_met]
        expected = free[0] if free else min(len(felt), 50)
        assert watch.slices_since_contact(way) == watch.slices_since_contact(0.1 * way) == expected
        assert watch.slices_since_contact() == expected, "its last motion went the same way"


@pytest.mark.parametrize(("against_n", "n"), [(np.nextafter(12.0, 0.0), 0), (12.0, 1), (np.nextafter(12.0, 13.0), 1)])
def test_contact_begins_at_its_threshold(against_n, n):
    watch = ContactWatch()
    watch.push(np.array([0.0, 0.0, against_n]), np.zeros(3))
    assert watch.slices_since_contact(np.array([0.0, 0.0, -1.0])) == n


def test_pressing_too_hard_is_a_stop():
    drive = make_drive()
    over_the_table(drive, 0.03)
    drive.limits = msgspec.structs.replace(drive.limits, tool_force_n=60.0)
    breach = play(drive, drive.motions.speeds.speedl((0, 0, -0.05, 0, 0, 0), 0.5, 5.0))
    assert breach is not None
    assert breach.cause in (Cause.TOOL_COLLISION, Cause.FORCE_VIOLATION)


def test_a_blow_on_a_joint_is_a_collision():
    drive = make_drive()
    over_the_table(drive, 0.03)
    drive.limits = msgspec.structs.replace(drive.limits, collision_nm=(10.0,) * 6)
    breach = play(drive, drive.motions.speeds.speedl((0, 0, -0.05, 0, 0, 0), 0.5, 5.0))
    assert breach is not None
    assert breach.code.startswith("C157")


def test_a_push_that_takes_the_arm_off_its_path_is_a_stop():
    drive = make_drive()
    drive.limits = msgspec.structs.replace(drive.limits, deviation_rad=0.01)
    drive.world.data.qfrc_applied[0] = 100.0
    breach = idle(drive, 300)
    assert breach is not None
    assert breach.code == "C153A0"


def test_a_far_servo_target_is_a_stop_and_is_never_followed():
    drive = make_drive()
    breach = play(drive, drive.motions.servoing.servoj(HOME + X * 0.5, lookahead_time=0.03, gain=2000))
    assert breach is not None
    assert breach.cause is Cause.JUMP
    idle(drive, 200)
    assert drive.measured.q_rad == pytest.approx(HOME, abs=1e-3)
    assert drive.is_standing


def test_a_plane_stops_the_tool_before_it_is_beyond():
    drive = make_drive()
    height = drive.measured.tcp_pose[2] - 0.05
    drive.limits = msgspec.structs.replace(drive.limits, planes=(Plane(normal=(0.0, 0.0, 1.0), offset_m=height),))
    breach = play(drive, drive.motions.speeds.speedl((0, 0, -0.1, 0, 0, 0), 1.2, 3.0))
    assert breach is not None
    assert breach.cause is Cause.PLANE
    idle(drive, 200)
    assert drive.is_standing
    assert drive.measured.tcp_pose[2] > height - 0.005


def test_a_violation_cuts_the_drives():
    drive = make_drive()
    drive.limits = msgspec.structs.replace(drive.limits, tool_speed_m_s=0.1, deviation_rad=9.0)
    drive.world.data.qfrc_applied[0] = 400.0
    breaches = [drive.tick() for _ in range(100)]
    assert Cause.TOOL_SPEED_VIOLATION in [breach.cause for breach in breaches if breach]
    assert drive.is_braked
    idle(drive, 300)
    assert drive.is_standing


def test_a_singular_pose_stops_a_tool_speed_that_goes_on():
    drive = make_drive()
    core, speeds = drive.core, drive.motions.speeds
    play(drive, speeds.speedl((0.1, 0, 0.1, 0, 0, 0), 1.0))
    assert core.tail is not None
    breach = idle(drive, 5000)
    assert breach is not None
    assert breach.cause in (Cause.SINGULARITY, Cause.TARGET_SPEED)


def step(drive, modes, motion):
    """One slice of a controller: the program, the drive, the modes. Returns whether the program goes on."""
    is_alive = motion is not None
    if is_alive and modes.may_move:
        is_alive = next(motion, "ended") != "ended"
    breach = drive.tick()
    if breach is not None:
        event = Event.VIOLATION if breach.cause.is_violation else Event.PROTECTIVE_STOP
        drive.obey(modes.handle(event, joint=breach.joint).motion)
    drive.obey(modes.tick(is_standing=drive.is_standing).motion)
    return is_alive


def powered():
    drive = make_drive(is_engaged=False)
    modes = Modes(times=PowerTimes(n_power_on=5, n_brake_release=5, n_before_unlock=400))
    modes.handle(Event.BRAKE_RELEASE)
    for _ in range(12):
        step(drive, modes, None)
    assert modes.robot is RobotMode.RUNNING
    assert not drive.is_braked
    modes.handle(Event.PLAY)
    return drive, modes


@pytest.mark.parametrize(
    ("happens", "is_over"),
    [
        (Event.PAUSE, (Event.PLAY,)),
        (Event.SAFEGUARD_OPENED, (Event.SAFEGUARD_CLOSED,)),
        (Event.PROTECTIVE_STOP, (Event.UNLOCK_PROTECTIVE_STOP, Event.PLAY)),
    ],
)
def test_a_move_that_is_stopped_and_resumed_ends_where_it_should(happens, is_over):
    drive, modes = powered()
    goal = HOME + X * 0.8
    motion = drive.motions.moves.movej(goal)
    for _ in range(300):
        step(drive, modes, motion)
    drive.obey(modes.handle(happens).motion)
    for _ in range(500):
        step(drive, modes, motion)
    assert modes.runtime is RuntimeState.PAUSED
    assert drive.is_standing
    for event in is_over:
        reaction = modes.handle(event)
        assert reaction.refusal is None
        drive.obey(reaction.motion)
    n = 0
    while step(drive, modes, motion):
        n += 1
        assert n < 2000
    idle(drive, 100)
    assert modes.robot is RobotMode.RUNNING
    assert drive.measured.q_rad == pytest.approx(goal, abs=1e-3)


def test_an_emergency_stop_ends_in_brakes():
    drive, modes = powered()
    motion = drive.motions.moves.movej(HOME + X * 0.8)
    for _ in range(400):
        step(drive, modes, motion)
    drive.obey(modes.handle(Event.ROBOT_ESTOP).motion)
    for _ in range(300):
        step(drive, modes, None)
    assert (modes.robot, drive.is_braked, drive.is_standing) == (RobotMode.POWER_OFF, True, True)


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_is_stopped_before_its_limit(joint):
    drive = make_drive()
    drive.limits = msgspec.structs.replace(drive.limits, q_max_rad=tuple(HOME + 0.1))
    breach = play(drive, drive.motions.speeds.speedj(np.eye(6)[joint] * 0.3, 5.0, 3.0))
    assert breach is not None
    assert breach.code == f"C150A{joint}"
    idle(drive, 200)
    assert drive.is_standing
    assert drive.measured.q_rad[joint] < HOME[joint] + 0.11
    assert play(drive, drive.motions.moves.movej(HOME)) is None, "the way back is free"


def test_a_joint_too_fast_is_a_stop():
    drive = make_drive()
    drive.limits = msgspec.structs.replace(drive.limits, speed_rad_s=(0.5,) * 6)
    assert play(drive, drive.motions.speeds.speedj(X * 0.499, 2.0)) is None
    breach = play(drive, drive.motions.speeds.speedj(X * 0.51, 2.0))
    assert breach is not None
    assert breach.cause is Cause.TARGET_SPEED
