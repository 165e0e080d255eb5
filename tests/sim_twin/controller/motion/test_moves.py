import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_twin.controller.motion.core import MotionConflictError
from sim_twin.controller.motion.kinematics import KinematicsError
from sim_twin.controller.motion.paths import ArcPath, PathError
from sim_twin.controller.motion.poses import matrix_from_pose, pose_from_matrix
from tests.support.motion_bench import HOME, make_bench

X = np.array([1.0, 0, 0, 0, 0, 0])


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
    assert bench.run(bench.motions.moves.movel(bench.shifted(dz=0.05), 1.2, 0.25, 1.0)) == 500


def test_movej_to_a_pose_ends_there():
    bench = make_bench()
    pose = bench.shifted(dx=0.05, dy=0.1)
    bench.run(bench.motions.moves.movej(pose, is_pose=True))
    assert bench.here() == pytest.approx(matrix_from_pose(pose), abs=1e-9)


def test_movel_is_straight_within_a_tenth_of_a_millimetre():
    bench = make_bench()
    start, goal = bench.here()[:3, 3], bench.shifted(0.1, 0.2, -0.05)
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
    via, goal = bench.shifted(dx=0.05, dy=0.05), bench.shifted(dx=0.1)
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
        bench.run(bench.motions.moves.movec(bench.shifted(dx=0.02), bench.shifted(dx=0.04)))


def test_a_line_out_of_reach_is_refused_before_anything_moves():
    bench = make_bench()
    with pytest.raises(KinematicsError):
        bench.run(bench.motions.moves.movel(bench.shifted(dx=1.5)))
    assert len(bench.q) == 1


@pytest.mark.parametrize("r", [0.01, 0.03, 0.2])
def test_a_blend_passes_within_its_radius_and_never_stops(r):
    bench = make_bench()
    moves = bench.motions.moves
    corner, end = bench.shifted(dy=0.15), bench.shifted(dx=0.12, dy=0.15)
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
    goal = bench.shifted(dy=0.1)
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
    goal = bench.shifted(dx=0.05)
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


@pytest.mark.parametrize("low", [pytest.param(0.02, marks=pytest.mark.slow), 0.1, 0.5])
def test_a_blend_under_a_lowered_slider_goes_the_same_way_slower(low):
    ways = []
    for share in (1.0, low):
        bench = make_bench()
        moves, pace = bench.motions.moves, bench.motions.core.pace
        pace.set_slider(share)
        bench.idle(200)
        bench.q.clear(), bench.tool.clear()
        bench.run(
            moves.movel(bench.shifted(dy=0.15), 1.2, 0.25, r=0.03), moves.movel(bench.shifted(0.1, 0.15), 1.2, 0.25)
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
