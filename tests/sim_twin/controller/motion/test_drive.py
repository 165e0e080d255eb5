import msgspec
import numpy as np
import pytest

from config.loader import resolve
from robot.servo import lag_s
from sim_twin.controller.motion.drive import TwinDrive
from sim_twin.controller.motion.force import ForceTask
from sim_twin.plant import TwinWorld
from tests.support.motion_bench import HOME, idle, make_drive, over_the_table, play

X = np.array([1.0, 0, 0, 0, 0, 0])
STRETCHED = {
    0: [0, -0.6, 0.0, -1.2, -1.57, 0.0],
    1: [0, -2.7, 0.0, -1.2, -1.57, 0.0],
    2: [0, -1.57, -1.2, -1.57, -1.57, 0],
}


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


@pytest.mark.parametrize("force_n", [10.0, pytest.param(30.0, marks=pytest.mark.slow), 80.0])
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


def test_what_hangs_untold_biases_the_force_until_a_payload_is_told_or_the_force_zeroed():
    drive = make_drive()
    tool = drive.world.arm.tool
    idle(drive, 5)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-9)
    drive.hang(1.0)
    idle(drive, 5)
    assert drive.measured.wrench[2] == pytest.approx(-9.81)
    drive.zero_force()
    idle(drive, 5)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-2)
    drive.hang(2.0)
    idle(drive, 5)
    assert drive.measured.wrench[2] == pytest.approx(-9.81, abs=1e-2)
    drive.set_payload(tool.mass_kg, tool.com_m)
    idle(drive, 1)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-2)
    with pytest.raises(ValueError, match="payload"):
        drive.set_payload(-1.0)


def test_the_force_is_zeroed_once_more_at_the_end_of_a_payloads_transition():
    drive = make_drive()
    drive.set_payload(1.0, n_transition=10)
    idle(drive, 5)
    drive.hang(1.0)
    idle(drive, 5)
    assert np.abs(drive.measured.wrench).max() > 5.0
    idle(drive, 1)
    assert (drive.measured.wrench == 0.0).all()
    idle(drive, 5)
    assert drive.measured.wrench == pytest.approx(np.zeros(6), abs=1e-2)


def test_joint_history_reaches_back():
    drive = make_drive()
    seen = []
    for _ in drive.motions.speeds.speedj(X * 0.5, 2.0, 0.2):
        drive.tick()
        seen.append(drive.measured.q_rad)
    assert (drive.joint_history(10) == seen[-11]).all()
    assert (drive.joint_history(999) == seen[0]).all()
    for beyond in (-1, 1000):
        with pytest.raises(ValueError, match="expected 0 to 999 time steps"):
            drive.joint_history(beyond)


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


def test_the_set_points_tool_is_told():
    drive = make_drive()
    play(drive, drive.motions.speeds.speedl((0.0, 0.05, 0.0, 0.0, 0.0, 0.0), 0.5, 0.4))
    pose, speed = drive.core.target_tool()
    assert speed == pytest.approx([0, 0.05, 0, 0, 0, 0], abs=1e-4)
    # The twin trails by its servo's lag.
    assert pose[1] - drive.measured.tcp_pose[1] == pytest.approx(0.05 * 0.034, rel=0.1)


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
