"""Speeds, servo targets and forces that a program asks for again in every slice."""

import numpy as np
import pytest

from sim_twin.controller.motion.force import ForceKind, ForceTask, task_axes
from tests.support.motion_bench import HOME, make_bench

X = np.array([1.0, 0, 0, 0, 0, 0])


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
    bench.run(bench.motions.moves.movel(bench.shifted(dy=0.1, dz=0.1)))
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
