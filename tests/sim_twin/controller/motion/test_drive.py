import msgspec
import numpy as np
import pytest

from config.loader import resolve
from robot.servo import lag_s
from sim_twin.controller.modes import Event, Modes, PowerTimes, RobotMode, RuntimeState
from sim_twin.controller.motion.contact import ContactWatch
from sim_twin.controller.motion.drive import TwinDrive
from sim_twin.controller.motion.force import ForceTask
from sim_twin.controller.motion.limits import Cause, Plane
from sim_twin.plant import TwinWorld
from tests.support.motion_bench import HOME, make_drive, play

X = np.array([1.0, 0, 0, 0, 0, 0])
STRETCHED = {
    0: [0, -0.6, 0.0, -1.2, -1.57, 0.0],
    1: [0, -2.7, 0.0, -1.2, -1.57, 0.0],
    2: [0, -1.57, -1.2, -1.57, -1.57, 0],
}


def idle(drive, n):
    for _ in range(n):
        breach = drive.tick()
        if breach is not None:
            return breach
    return None


def over_the_table(drive, z):
    pose = drive.measured.tcp_pose.copy()
    pose[:3] = (0.40, 0.10, 0.15)
    assert play(drive, drive.motions.moves.movej(pose, is_pose=True)) is None
    pose[2] = z
    assert play(drive, drive.motions.moves.movel(pose, v=0.1)) is None


def test_a_drive_wants_a_world_whose_tick_is_a_slice():
    world = make_drive().world
    slow = TwinWorld(world.arm, world.scenario, resolve().rig)
    with pytest.raises(ValueError, match="tick_s"):
        TwinDrive(slow)


def test_without_power_the_joints_are_locked():
    drive = make_drive(is_engaged=False)
    drive.world.data.qfrc_applied[:6] = [20.0, 20.0, 20.0, 5.0, 5.0, 5.0]
    idle(drive, 500)
    assert drive.measured.q_rad == pytest.approx(HOME, abs=1e-3)


def test_power_up_holds_still_and_motion_is_deterministic():
    ends = []
    for _ in range(2):
        drive = make_drive(is_engaged=False)
        idle(drive, 20)
        drive.engage()
        idle(drive, 50)
        assert drive.measured.q_rad == pytest.approx(HOME, abs=1e-4)
        assert play(drive, drive.motions.moves.movej(HOME + X * 0.3), drive.motions.speeds.speedj(-X, 2.0, 0.1)) is None
        ends.append(drive.world.data.qpos.copy())
    assert (ends[0] == ends[1]).all()


def test_the_measured_tool_is_the_twins():
    drive = make_drive()
    play(drive, drive.motions.speeds.speedl((0.0, 0.05, -0.02, 0.0, 0.0, 0.1), 0.5, 0.4))
    site = drive.world.data.site("tcp")
    # Sites are those of the step's begin: one slice of motion behind.
    assert drive.measured.tcp_pose[:3] == pytest.approx(site.xpos, abs=3e-4)
    assert drive.measured.tcp_speed == pytest.approx([0.0, 0.05, -0.02, 0.0, 0.0, 0.1], abs=5e-3)


@pytest.mark.parametrize(("lookahead", "gain"), [(0.03, 1200), (0.03, 2000), (0.1, 300), (0.2, 100)])
def test_servojs_lag_on_the_physics_is_the_law(lookahead, gain):
    drive = make_drive()
    target, rate, lags = HOME.copy(), 0.4, []
    for _ in range(700):
        target = target + X * rate * 0.002
        assert play(drive, drive.motions.servoing.servoj(target, t=0.002, lookahead_time=lookahead, gain=gain)) is None
        # The joints are measured a slice after the target was sent: the ramp has gone on meanwhile.
        lags.append((target - drive.measured.q_rad)[0] / rate + 0.002)
    law = lag_s(lookahead_s=lookahead, gain=gain, dead_time_s=0.004)
    assert np.mean(lags[-50:]) == pytest.approx(law, rel=0.1)


@pytest.mark.parametrize("rate", [0.5, 1.5, 2.8])
def test_targets_that_come_a_hundred_times_a_second_are_no_jumps(rate):
    drive = make_drive()
    target = HOME.copy()
    for k in range(60):
        target = target + X * min(rate, 0.1 * k) * 0.01
        servo = drive.motions.servoing.servoj(target, t=0.01, lookahead_time=0.03, gain=1200)
        assert play(drive, servo) is None
    # The steps of 10 ms add 4 ms to a law that knows of steps of 2.
    lag_of_it = (target - drive.measured.q_rad)[0] / rate + 0.002
    assert lag_of_it == pytest.approx(0.031, abs=0.006), "seen at the end of the last target's 10 ms"


# UR's figures for the CB3 UR5 at full speed, stretched out: distance and time of a category 0 stop.
@pytest.mark.parametrize("is_cut", [False, True])
@pytest.mark.parametrize(("joint", "distance_rad", "time_s"), [(0, 0.31, 0.244), (1, 0.70, 0.530), (2, 0.22, 0.164)])
def test_a_stop_takes_about_what_ur_publishes(joint, distance_rad, time_s, is_cut):
    drive = make_drive(np.array(STRETCHED[joint]))
    drive.limits = msgspec.structs.replace(drive.limits, tool_speed_m_s=5.0)
    speed = np.eye(6)[joint] * 3.1
    assert play(drive, drive.motions.speeds.speedj(speed, 6.0, 3.1 / 6.0 + 0.1)) is None
    start, n = drive.measured.q_rad[joint], 0
    drive.stop(is_cut=is_cut)
    while abs(drive.measured.qd_rad_s[joint]) > 0.02:
        assert drive.tick() is None
        n += 1
    assert drive.measured.q_rad[joint] - start == pytest.approx(distance_rad, rel=0.15)
    assert n * 0.002 == pytest.approx(time_s, rel=0.4)
    idle(drive, 100)
    assert drive.is_standing


@pytest.mark.parametrize("force_n", [10.0, 30.0, 80.0])
def test_force_mode_presses_on_the_table_with_what_was_asked(force_n):
    drive = make_drive()
    over_the_table(drive, 0.03)
    drive.core.force_mode(
        ForceTask(frame=(0,) * 6, is_compliant=(0, 0, 1, 0, 0, 0), wrench=(0, 0, -force_n, 0, 0, 0), limits=(0.05,) * 6)
    )
    felt = []
    for _ in range(5000):
        assert drive.tick() is None
        felt.append(drive.measured.wrench[2])
    assert np.mean(felt[-250:]) == pytest.approx(force_n, rel=0.05)
    assert max(felt) < 1.7 * force_n, "a blow of its own making stays small"
    drive.core.end_force_mode()
    idle(drive, 100)
    assert drive.measured.wrench[2] > 0.5 * force_n, "it stays where it pressed"


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


def test_freedrive_gives_way_and_stays():
    drive = make_drive()
    drive.core.freedrive()
    drive.world.data.qfrc_applied[0] = 5.0
    assert idle(drive, 250) is None
    moved = drive.measured.q_rad[0] - HOME[0]
    assert moved > 0.02
    drive.world.data.qfrc_applied[0] = 0.0
    drive.core.end_freedrive()
    assert idle(drive, 300) is None
    rest = drive.measured.q_rad
    idle(drive, 200)
    assert drive.measured.q_rad == pytest.approx(rest, abs=1e-3)


def test_freedrive_holds_the_axes_that_are_not_free():
    drive = make_drive()
    start = drive.measured.tcp_pose
    drive.core.freedrive((0, 0, 1, 0, 0, 0))
    J = drive.kinematics.jacobian(drive.measured.q_rad, drive.core.T_ft)
    drive.world.data.qfrc_applied[:6] = J.T @ [10.0, 10.0, 20.0, 0, 0, 0]
    assert idle(drive, 250) is None
    way = drive.measured.tcp_pose[:3] - start[:3]
    assert way[2] > 0.01
    assert np.abs(way[:2]).max() < 0.2 * way[2]


def test_a_wrong_payload_biases_the_force():
    drive = make_drive()
    tool = drive.world.arm.tool
    idle(drive, 5)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-9)
    drive.set_payload(tool.mass_kg + 1.0, tool.com_m)
    idle(drive, 5)
    assert drive.measured.wrench[2] == pytest.approx(9.81)
    drive.zero_force()
    idle(drive, 5)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-2)
    with pytest.raises(ValueError, match="payload"):
        drive.set_payload(-1.0)


def test_joint_history_reaches_back():
    drive = make_drive()
    seen = []
    for _ in drive.motions.speeds.speedj(X * 0.5, 2.0, 0.2):
        drive.tick()
        seen.append(drive.measured.q_rad)
    assert (drive.joint_history(10) == seen[-11]).all()
    assert (drive.joint_history(10_000) == seen[0]).all()


def test_weight_shows_in_the_currents():
    drive = make_drive()
    idle(drive, 5)
    assert abs(drive.measured.torque_nm[1]) > 10.0
    assert drive.measured.current_a[1] == pytest.approx(drive.measured.torque_nm[1] / 13.6)


def test_no_current_flows_where_the_brakes_hold():
    drive = make_drive()
    idle(drive, 5)
    for is_cut in (True, False):
        drive.stop(is_cut=is_cut)
        drive.lock()
        idle(drive, 5)
        assert (drive.measured.torque_nm == 0.0).all()
        assert (drive.measured.current_a == 0.0).all()
    drive.engage()
    idle(drive, 5)
    assert abs(drive.measured.torque_nm[1]) > 10.0


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


def test_the_set_points_tool_is_told():
    drive = make_drive()
    play(drive, drive.motions.speeds.speedl((0.0, 0.05, 0.0, 0.0, 0.0, 0.0), 0.5, 0.4))
    pose, speed = drive.core.target_tool()
    assert speed == pytest.approx([0, 0.05, 0, 0, 0, 0], abs=1e-4)
    # The twin trails by its servo's lag.
    assert pose[1] - drive.measured.tcp_pose[1] == pytest.approx(0.05 * 0.034, rel=0.1)


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


def test_movel_is_straight_on_the_physics_too():
    drive = make_drive()
    start, goal = drive.measured.tcp_pose, drive.measured.tcp_pose.copy()
    goal[:3] += (0.05, 0.15, 0.0)
    way = (goal - start)[:3] / np.linalg.norm((goal - start)[:3])
    seen = []
    for _ in drive.motions.moves.movel(goal, 0.5, 0.2):
        assert drive.tick() is None
        seen.append(drive.measured.tcp_pose[:3] - start[:3])
    off = np.linalg.norm(np.cross(seen, way), axis=1)
    # The joints' equal lag bends no line; what is left is the arm's inertia.
    assert off.max() < 2e-3
