import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_twin.controller.motion.core import MotionConflictError
from sim_twin.controller.motion.force import ForceKind, ForceTask, task_axes
from sim_twin.controller.motion.kinematics import KinematicsError
from sim_twin.controller.motion.paths import ArcPath, PathError
from sim_twin.controller.motion.poses import matrix_from_pose, pose_from_matrix
from tests.support.motion_bench import HOME, make_bench

X = np.array([1.0, 0, 0, 0, 0, 0])


def shifted(bench, dx=0.0, dy=0.0, dz=0.0):
    pose = pose_from_matrix(bench.here())
    pose[:3] += (dx, dy, dz)
    return pose


def test_movej_takes_the_leading_joints_trapezoid():
    bench = make_bench()
    # 1.4 rad/s² to 1.05 rad/s is 0.75 s and 0.39375 rad; 1 rad is 0.75 + 1 / 1.05 s = 1.7024 s
    n = bench.run(bench.motions.moves.movej(np.add(HOME, [1.0, -0.5, 0.2, 0, 0, 0]), 1.4, 1.05))
    assert n == 852
    assert np.abs(bench.qd).max(axis=0)[:3] == pytest.approx([1.05, 0.525, 0.21], rel=1e-6)
    assert bench.q[-1] == pytest.approx(np.add(HOME, [1.0, -0.5, 0.2, 0, 0, 0]), abs=1e-12)
    assert bench.largest_step().max() <= 1.4 * (1 + 1e-6)


def test_a_time_overrides_speed_and_acceleration():
    bench = make_bench()
    assert bench.run(bench.motions.moves.movej(HOME + 0.3, 1.4, 1.05, 2.0)) == 1000
    assert bench.run(bench.motions.moves.movel(shifted(bench, dz=0.05), 1.2, 0.25, 1.0)) == 500


def test_movej_to_a_pose_ends_there():
    bench = make_bench()
    pose = shifted(bench, dx=0.05, dy=0.1)
    bench.run(bench.motions.moves.movej(pose, is_pose=True))
    assert bench.here() == pytest.approx(matrix_from_pose(pose), abs=1e-9)


def test_movel_is_straight_within_a_tenth_of_a_millimetre():
    bench = make_bench()
    start, goal = bench.here()[:3, 3], shifted(bench, 0.1, 0.2, -0.05)
    n = bench.run(bench.motions.moves.movel(goal, 1.2, 0.25))
    way = goal[:3] - start
    length = np.linalg.norm(way)
    off = np.linalg.norm(np.cross(bench.path() - start, way / length), axis=1)
    assert off.max() < 1e-8
    assert bench.path()[-1] == pytest.approx(goal[:3], abs=1e-9)
    speeds = np.linalg.norm(np.diff(bench.path(), axis=0), axis=1) / 0.002
    assert speeds.max() == pytest.approx(0.25, rel=1e-6)
    assert n == np.ceil((length / 0.25 + 0.25 / 1.2) / 0.002)
    assert np.abs(np.diff(speeds)).max() / 0.002 <= 1.2 * (1 + 1e-3)


def test_movel_turns_evenly():
    bench = make_bench()
    goal = pose_from_matrix(bench.here() @ matrix_from_pose((0, 0, 0, 0, 0, 0.8)))
    bench.run(bench.motions.moves.movel(goal))
    assert bench.here() == pytest.approx(matrix_from_pose(goal), abs=1e-9)
    assert np.ptp(bench.path(), axis=0).max() < 1e-9


def test_movec_stays_on_its_circle():
    bench = make_bench()
    start = bench.here()[:3, 3]
    via, goal = shifted(bench, dx=0.05, dy=0.05), shifted(bench, dx=0.1)
    bench.run(bench.motions.moves.movec(via, goal))
    centre = np.add(start, [0.05, 0, 0])
    assert np.linalg.norm(bench.path() - centre, axis=1) == pytest.approx(0.05, abs=1e-8)
    assert bench.path()[-1] == pytest.approx(goal[:3], abs=1e-9)
    assert bench.path()[:, 1].max() == pytest.approx(start[1] + 0.05, abs=1e-5)


def test_movec_fixed_turns_the_tool_with_the_tangent():
    T = np.eye(4)
    path = ArcPath(T, np.array([1.0, 1.0, 0]), matrix_from_pose((2, 0, 0, 0, 0, 0)), is_fixed=True)
    assert path.at(path.length)[:3, :3] == pytest.approx(np.diag([-1.0, -1.0, 1.0]), abs=1e-12)
    assert path.length == pytest.approx(np.pi)


def test_three_points_on_a_line_make_no_circle():
    bench = make_bench()
    with pytest.raises(PathError, match="not on one line"):
        bench.run(bench.motions.moves.movec(shifted(bench, dx=0.02), shifted(bench, dx=0.04)))


def test_a_line_out_of_reach_is_refused_before_anything_moves():
    bench = make_bench()
    with pytest.raises(KinematicsError):
        bench.run(bench.motions.moves.movel(shifted(bench, dx=1.5)))
    assert len(bench.q) == 1


@pytest.mark.parametrize("r", [0.01, 0.03, 0.2])
def test_a_blend_passes_within_its_radius_and_never_stops(r):
    bench = make_bench()
    moves = bench.motions.moves
    corner, end = shifted(bench, dy=0.15), shifted(bench, dx=0.12, dy=0.15)
    n = bench.run(moves.movel(corner, 1.2, 0.25, r=r), moves.movel(end, 1.2, 0.25))
    distance = np.linalg.norm(bench.path() - corner[:3], axis=1)
    assert distance.min() <= r
    assert distance.min() > 0.0005, "a blend cuts the corner"
    speeds = np.linalg.norm(np.diff(bench.path(), axis=0), axis=1) / 0.002
    within = distance[1:] < min(r, 0.075)
    assert speeds[within].min() > 0.4 * min(0.25, (2 * 1.2 * r) ** 0.5)
    assert speeds.max() < 0.25 * 1.05
    assert bench.path()[-1] == pytest.approx(end[:3], abs=1e-8)
    stopped = make_bench()
    assert n < stopped.run(*(stopped.motions.moves.movel(p, 1.2, 0.25) for p in (corner, end)))


def test_speed_and_position_have_no_jump_through_joint_blends():
    bench = make_bench()
    moves = bench.motions.moves
    a, b = np.add(HOME, [0.5, 0, 0, 0, 0, 0]), np.add(HOME, [0.5, -0.3, 0.3, 0, 0, 0])
    bench.run(moves.movej(a, 1.4, 1.05, r=0.05), moves.movej(b, 1.4, 1.05))
    assert bench.largest_step().max() <= 2 * 1.4 * (1 + 1e-3), "at most both moves' accelerations"
    assert bench.q[-1] == pytest.approx(b, abs=1e-12)


def test_a_straight_blend_keeps_its_speed():
    bench = make_bench()
    moves = bench.motions.moves
    middle, end = HOME + X * 0.6, HOME + X * 1.2
    bench.run(moves.movej(middle, 1.4, 0.6, r=0.1), moves.movej(end, 1.4, 0.6))
    speed = np.array(bench.qd)[:, 0]
    moving = speed[(np.array(bench.q)[:, 0] > HOME[0] + 0.3) & (np.array(bench.q)[:, 0] < HOME[0] + 0.9)]
    assert moving == pytest.approx(0.6, rel=1e-2)


def test_a_blend_that_nobody_takes_over_ends_at_its_way_point():
    bench = make_bench()
    goal = shifted(bench, dy=0.1)
    bench.run(bench.motions.moves.movel(goal, r=0.05))
    assert np.linalg.norm(bench.path()[-1] - goal[:3]) <= 0.05
    assert not bench.motions.core.is_at_rest
    bench.idle(400)
    assert bench.path()[-1] == pytest.approx(goal[:3], abs=1e-9)
    assert bench.motions.core.is_at_rest


def test_a_move_takes_over_from_a_speed():
    bench = make_bench()
    bench.run(bench.motions.speeds.speedj(X * 0.8, 2.0, 0.6))
    goal = HOME - X * 0.3
    bench.run(bench.motions.moves.movej(goal, 2.0, 1.0))
    assert bench.largest_step().max() <= 2 * 2.0 * (1 + 1e-3)
    assert bench.q[-1] == pytest.approx(goal, abs=1e-12)


def test_movel_takes_over_from_a_speed_of_joints():
    bench = make_bench()
    goal = shifted(bench, dx=0.05)
    bench.run(bench.motions.speeds.speedj(X * 0.3, 2.0, 0.3), bench.motions.moves.movel(goal))
    assert np.abs(np.diff(bench.q, axis=0)).max() < 0.01
    assert bench.path()[-1] == pytest.approx(goal[:3], abs=1e-8)


def test_an_abandoned_move_comes_to_rest_without_a_jump():
    bench = make_bench()
    motion = bench.motions.moves.movej(HOME + X, 1.4, 1.05)
    for _ in range(500):
        next(motion)
        bench.end()
    bench.idle(200)
    assert bench.motions.core.is_at_rest
    assert bench.largest_step().max() <= 10.0 * (1 + 1e-3)


def test_the_slider_stretches_time_and_a_pause_stands_still_on_the_path():
    bench = make_bench()
    goal = HOME + X * 0.5
    pace = bench.motions.core.pace
    bench.motions.core.pace.set_slider(0.5)
    bench.idle(200)
    full = make_bench()
    n = full.run(full.motions.moves.movej(goal))
    assert bench.run(bench.motions.moves.movej(goal)) == pytest.approx(2 * n, abs=2)
    motion, seen = bench.motions.moves.movej(HOME), []

    def meddle(k):
        pace.is_paused = 300 <= k < 700
        seen.append(np.abs(bench.qd[-1]).max())

    bench.run(motion, at=meddle)
    assert max(seen[500:700]) == 0.0
    assert bench.q[-1] == pytest.approx(HOME, abs=1e-12)
    assert bench.largest_step().max() < 1.05 * 4.0 + 1.4


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_slider_beyond_its_ends_is_refused(share):
    with pytest.raises(ValueError, match="speed slider"):
        make_bench().motions.core.pace.set_slider(share)


def test_after_a_stop_off_the_path_a_resumed_move_comes_back_to_it():
    bench = make_bench()
    goal = np.add(HOME, [1.0, 0.1, 0, 0, 0, 0])
    motion = bench.motions.moves.movej(goal)
    for _ in range(400):
        next(motion)
        bench.end()
    bench.motions.core.begin_stop()
    bench.idle(300)
    assert bench.motions.core.is_at_rest
    n = len(bench.q)
    bench.run(motion)
    assert np.abs(np.diff(bench.q[n - 1 :], axis=0)).max() < 1.05 * 2 * 0.002
    assert bench.q[-1] == pytest.approx(goal, abs=1e-12)


def test_two_motions_in_one_slice_are_a_conflict():
    bench = make_bench()
    a, b = bench.motions.moves.movej(HOME + 0.1), bench.motions.moves.movej(HOME - 0.1)
    next(a)
    with pytest.raises(MotionConflictError, match="one motion at a time"):
        next(b)


def test_speedj_reaches_its_speed_and_keeps_it_until_told():
    bench = make_bench()
    n = bench.run(bench.motions.speeds.speedj(X * 0.7, 1.4))
    assert n == 250
    bench.idle(100)
    assert bench.qd[-1] == pytest.approx(X * 0.7, abs=1e-9)
    assert bench.run(bench.motions.speeds.stopj(3.5)) == 100
    assert bench.largest_step().max() <= 3.5 * (1 + 1e-6)
    bench.idle(2)
    assert bench.motions.core.is_at_rest


def test_speedj_with_a_time_slows_down_after_it():
    bench = make_bench()
    assert bench.run(bench.motions.speeds.speedj(X * 0.7, 1.4, 1.0)) == 500
    bench.idle(260)
    assert bench.motions.core.is_at_rest
    assert bench.largest_step().max() <= 1.4 * (1 + 1e-6)


def test_speedl_moves_the_tool_along_a_line_and_stopl_stays_on_it():
    bench = make_bench()
    start = bench.path()[0]
    speeds = bench.motions.speeds
    bench.run(speeds.speedl((0.0, 0.1, 0.0, 0, 0, 0), 0.5, 1.0), speeds.stopl(1.0))
    off = bench.path() - start
    # 0.01 m while speeding up, 0.08 m at 0.1 m/s, 0.005 m while stopping
    assert off[-1] == pytest.approx([0.0, 0.095, 0.0], abs=3e-4)
    assert np.abs(off[:, [0, 2]]).max() < 1e-4


@pytest.mark.parametrize("call", ["speedj", "speedl"])
def test_no_acceleration_is_refused(call):
    with pytest.raises(ValueError, match="acceleration"):
        getattr(make_bench().motions.speeds, call)(X, 0.0)


def test_servoj_trails_a_ramp_by_its_filter_and_holds_the_last_target():
    bench = make_bench()
    target, rate = HOME.copy(), 0.5
    for _ in range(600):
        target = target + X * rate * 0.002
        bench.run(bench.motions.servoing.servoj(target, t=0.002, lookahead_time=0.1, gain=300))
    # the law says 117.3 ms, the servo behind takes 35
    assert (target - bench.q[-1])[0] / rate == pytest.approx(0.1173 - 0.035, abs=1e-3)
    bench.idle(700)
    assert bench.q[-1] == pytest.approx(target, abs=1e-6)


@pytest.mark.parametrize(("lookahead", "gain"), [(0.029, 300), (0.21, 300), (0.1, 99), (0.1, 2001)])
def test_servoj_outside_its_ranges_is_refused(lookahead, gain):
    bench = make_bench()
    with pytest.raises(ValueError, match="servoj"):
        bench.run(bench.motions.servoing.servoj(HOME, lookahead_time=lookahead, gain=gain))


def test_the_slider_stretches_servojs_time():
    bench = make_bench()
    bench.motions.core.pace.set_slider(0.5)
    bench.idle(200)
    assert bench.run(bench.motions.servoing.servoj(HOME, t=0.02)) == 20


def test_force_mode_moves_in_proportion_to_the_missing_force_and_no_faster_than_allowed():
    bench = make_bench()
    core = bench.motions.core
    down = {"frame": (0,) * 6, "is_compliant": (0, 0, 1, 0, 0, 0), "damping": 0.0}
    core.force_mode(ForceTask(wrench=(5, 0, -10, 0, 0, 0), **down))
    bench.idle(100)
    speed = np.diff(bench.path()[-2:], axis=0)[0] / 0.002
    assert speed == pytest.approx([0, 0, -0.006], abs=1e-4)
    core.force_mode(ForceTask(wrench=(0, 0, -100, 0, 0, 0), limits=(0.03,) * 6, **down))
    bench.idle(100)
    assert np.diff(bench.path()[-2:], axis=0)[0] / 0.002 == pytest.approx([0, 0, -0.03], abs=1e-4)
    bench.sensed.wrench = np.array([0, 0, 100.0, 0, 0, 0])
    bench.idle(100)
    assert np.diff(bench.path()[-2:], axis=0)[0] / 0.002 == pytest.approx([0, 0, 0], abs=1e-4)
    core.end_force_mode()
    bench.idle(50)
    assert core.is_at_rest
    assert np.abs(np.diff(bench.q, axis=0)).max() < 0.001


def test_a_move_in_force_mode_keeps_to_its_own_axes():
    bench = make_bench()
    start = bench.path()[0]
    bench.motions.core.force_mode(
        ForceTask(frame=(0,) * 6, is_compliant=(0, 0, 1, 0, 0, 0), wrench=(0, 0, -10, 0, 0, 0))
    )
    bench.run(bench.motions.moves.movel(shifted(bench, dy=0.1, dz=0.1)))
    off = bench.path()[-1] - start
    assert off[1] == pytest.approx(0.1, abs=2e-3)
    assert off[2] < 0.0, "the compliant axis follows the force, not the move"


def test_the_task_frame_is_read_by_its_kind():
    task = {"frame": (0, 0, 0, 0, 0, 0), "is_compliant": (1,) * 6, "wrench": (0,) * 6}
    tool, speed = np.array([1.0, 0, 0]), np.array([0, 2.0, 5.0])
    assert task_axes(ForceTask(kind=ForceKind.FRAME, **task), tool, speed) == pytest.approx(np.eye(3))
    assert task_axes(ForceTask(kind=ForceKind.POINT, **task), tool, speed)[:, 1] == pytest.approx([-1, 0, 0])
    assert task_axes(ForceTask(kind=ForceKind.MOTION, **task), tool, speed)[:, 0] == pytest.approx([0, 1, 0])
    for kind in ForceKind:
        assert np.linalg.det(task_axes(ForceTask(kind=kind, **task), tool, speed)) == pytest.approx(1.0)


def test_force_mode_may_be_called_in_every_slice():
    once, often = make_bench(), make_bench()
    task = ForceTask(frame=(0,) * 6, is_compliant=(0, 0, 1, 0, 0, 0), wrench=(0, 0, -10, 0, 0, 0))
    once.motions.core.force_mode(task)
    for _ in range(50):
        often.motions.core.force_mode(task)
        once.end()
        often.end()
    assert (once.q[-1] == often.q[-1]).all()
    assert once.path()[-1][2] < once.path()[0][2]


@pytest.mark.parametrize(("a", "v"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, float("nan"))])
def test_a_move_without_speed_is_refused_and_what_moved_before_goes_on(a, v):
    bench = make_bench()
    bench.run(bench.motions.speeds.speedj(X * 0.3, 2.0))
    tail = bench.motions.core.tail
    with pytest.raises(ValueError, match="above 0"):
        bench.run(bench.motions.moves.movej(HOME, a, v))
    assert bench.motions.core.tail is tail


# A slider's share before, the one it falls to, and the one it is raised to.
SLIDERS = st.tuples(*(st.sampled_from((0.0, 0.01, 0.05, 0.3, 1.0)),) * 3)


@settings(deadline=None, max_examples=25, derandomize=True)
@given(
    sliders=SLIDERS,
    n_falling=st.integers(0, 130),
    v=st.floats(0.3, 3.0),
    a=st.floats(2.0, 20.0),
    kind=st.integers(0, 2),
)
def test_what_is_taken_over_goes_no_further_than_its_speed_takes_it(sliders, n_falling, v, a, kind):
    bench = make_bench()
    motions, pace = bench.motions, bench.motions.core.pace
    pace.set_slider(sliders[0])
    gently = 0.5  # slower than the pace falls: the speed is what it was when the pace is low already
    before = (
        lambda: motions.speeds.speedj(X * v, 8.0, 0.4),
        lambda: motions.speeds.speedj(X * v, 8.0, 0.4),
        lambda: motions.speeds.speedl((0, v / 4, 0, 0, 0, 0), 2.0, 0.4),
    )[kind]
    bench.run(before())
    pace.set_slider(sliders[1])
    pace.is_paused = kind == 1
    bench.run(motions.speeds.speedj(motions.setpoint.qd_target, gently, max(0.002, n_falling * 0.002)))
    pace.is_paused = False
    start, speed = motions.setpoint.q_target, motions.setpoint.qd_target
    taken = len(bench.q)

    def raise_again(n):
        if n == 60:
            pace.set_slider(max(0.05, sliders[2]))

    bench.run(motions.moves.movej(start, a, 1.0), at=raise_again)
    fastest = np.abs(speed).max()
    ways = np.abs(np.array(bench.q[taken:]) - start).max(axis=0)
    assert ways.max() <= fastest**2 / (2 * a) * 1.01 + fastest * 0.004
    assert np.abs(bench.qd[taken:]).max() <= fastest * 1.01 + 0.02, "a slider makes nothing faster than it was"
    assert motions.setpoint.q_target == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("low", [0.02, 0.1, 0.5])
def test_a_blend_under_a_lowered_slider_goes_the_same_way_slower(low):
    ways = []
    for share in (1.0, low):
        bench = make_bench()
        moves, pace = bench.motions.moves, bench.motions.core.pace
        pace.set_slider(share)
        bench.idle(200)
        bench.q.clear(), bench.tool.clear()
        bench.run(
            moves.movel(shifted(bench, dy=0.15), 1.2, 0.25, r=0.03), moves.movel(shifted(bench, 0.1, 0.15), 1.2, 0.25)
        )
        ways.append(bench.path())
    off = [np.linalg.norm(ways[1] - p, axis=1).min() for p in ways[0][::10]]
    assert max(off) < 1e-3
    assert len(ways[1]) == pytest.approx(len(ways[0]) / low, rel=0.05)


@pytest.mark.parametrize("move", ["movel", "movep", "servoc", "movec"])
def test_a_tool_move_to_where_no_arm_reaches_says_so(move):
    bench = make_bench()
    moves, there = bench.motions.moves, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    points = ((0.4, 0.3, 0.4, 0.0, 0.0, 0.0), there) if move == "movec" else (there,)
    with pytest.raises(KinematicsError, match="no joint angles bring the tool to") as told:
        next(getattr(moves, move)(*points))
    assert "seed" not in str(told.value)
