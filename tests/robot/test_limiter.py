import math

import numpy as np
import pytest

from robot.motion.limiter import AxisLimits, Limiter

DT = 0.01
LIMITS = AxisLimits(speed=(1.0, 2.0), acceleration=(5.0, 8.0), jerk=(100.0, 200.0))


def run(limiter, n):
    return np.array([limiter.step() for _ in range(n)])


def wander(limiter, rng, n=200):
    """Give a new target every five ticks."""
    path = []
    for _ in range(n):
        limiter.aim(rng.uniform(-0.3, 0.3, 2).tolist())
        path += [limiter.step() for _ in range(5)]
    return np.array(path)


def test_it_comes_to_rest_on_the_target_without_overshoot():
    limiter = Limiter(LIMITS, tick_s=DT)
    limiter.aim([0.2, -0.1])
    path = run(limiter, 200)
    assert path[-1] == pytest.approx([0.2, -0.1], abs=1e-9)
    assert path[:, 0].max() <= 0.2 + 1e-9
    assert path[:, 1].min() >= -0.1 - 1e-9


def test_speed_acceleration_and_jerk_hold_under_any_targets():
    path = wander(Limiter(LIMITS, tick_s=DT), np.random.default_rng(0))
    speed = np.diff(path, axis=0) / DT
    acceleration = np.diff(speed, axis=0) / DT
    jerk = np.diff(acceleration, axis=0) / DT
    assert (np.abs(speed).max(0) <= np.array(LIMITS.speed) * (1 + 1e-6)).all()
    assert (np.abs(acceleration).max(0) <= np.array(LIMITS.acceleration) * (1 + 1e-6)).all()
    assert (np.abs(jerk).max(0) <= np.array(LIMITS.jerk) * (1 + 1e-6)).all()


def test_braking_rests_ahead_within_the_shortest_way_the_limits_allow():
    limiter = Limiter(LIMITS, tick_s=DT)
    limiter.aim([10.0, 0.0])
    run(limiter, 100)
    at, speed = limiter.at[0], limiter.speed[0]
    stop = limiter.brake()
    # From v, jerk up to a and back: v (v/a + a/j) / 2.
    assert stop[0] - at == pytest.approx(speed * (speed / 5.0 + 5.0 / 100.0) / 2, rel=0.02)
    assert run(limiter, 100)[-1] == pytest.approx(stop, abs=1e-9)


def test_seeding_forgets_everything_before():
    rng = np.random.default_rng(1)
    used, fresh = Limiter(LIMITS, tick_s=DT), Limiter(LIMITS, tick_s=DT)
    wander(used, rng)
    used.seed([0.1, 0.2])
    fresh.seed([0.1, 0.2])
    assert (wander(used, np.random.default_rng(2)) == wander(fresh, np.random.default_rng(2))).all()


def test_what_ruckig_refuses_becomes_a_bounded_stop():
    limiter = Limiter(LIMITS, tick_s=DT)
    limiter.aim([5.0, 5.0])
    before = run(limiter, 60)
    limiter.aim([math.nan, 0.0])
    path = np.vstack([before[-2:], run(limiter, 100)])
    assert limiter.is_failed
    acceleration = np.diff(np.diff(path, axis=0) / DT, axis=0) / DT
    assert (np.abs(acceleration).max(0) <= np.array(LIMITS.acceleration) * (1 + 1e-6)).all()
    assert np.abs(path[-1] - path[-2]).max() == 0.0
    limiter.aim([0.0, 0.0])
    assert run(limiter, 600)[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert not limiter.is_failed


def test_an_axis_about_to_reach_its_greatest_speed_is_not_slowed_by_a_target_further_off():
    # Seen over the wire: planned anew exactly as it would reach that speed, an axis slowed down for 60 ms.
    dt, rng, n_reaching = 0.002, np.random.default_rng(0), 0
    limits = AxisLimits(speed=(0.5, 0.5), acceleration=(3.0, 3.0), jerk=(100.0, 100.0))
    for _ in range(100):
        limiter = Limiter(limits, tick_s=dt)
        for _ in range(8):
            before = limiter.speed[0]
            limiter.aim([limiter.at[0] + 0.09, 0.0])
            run(limiter, int(rng.integers(5, 20)))
            n_reaching += 0.45 < before < 0.5 - 1e-6
            assert limiter.speed[0] >= before - 1e-9
    assert n_reaching > 30


def test_one_that_goes_on_from_the_places_it_came_by_makes_no_jolt():
    limiter = Limiter(LIMITS, tick_s=DT)
    limiter.aim([0.3, -0.2])
    path = [limiter.step() for _ in range(12)]
    again = Limiter(LIMITS, tick_s=DT)
    again.go_on(*path[-3:])
    again.aim([0.3, -0.2])
    path += [again.step() for _ in range(100)]
    jerk = np.abs(np.diff(path, 3, axis=0)) / DT**3
    assert (jerk.max(0) <= 1.3 * np.array(LIMITS.jerk)).all()
    assert path[-1] == pytest.approx([0.3, -0.2], abs=1e-9)


def test_slowed_to_a_share_it_brakes_within_its_limits_and_stays_there():
    limiter = Limiter(LIMITS, tick_s=DT)
    limiter.aim([10.0, 5.0])
    path = list(run(limiter, 60))
    limiter.slow_to(0.25)
    path = np.array([*path, *run(limiter, 60)])
    speed = np.abs(np.diff(path, axis=0)) / DT
    assert (speed[-10:].max(0) <= 0.25 * np.array(LIMITS.speed) * (1 + 1e-6)).all()
    assert (np.abs(np.diff(path, 3, axis=0)).max(0) / DT**3 <= np.array(LIMITS.jerk) * (1 + 1e-6)).all()
    limiter.slow_to(1.0)
    assert np.abs(np.diff(run(limiter, 60), axis=0)).max() / DT > 0.9


@pytest.mark.parametrize("is_kept", [True, False])
def test_a_brake_that_a_limit_begins_anew_in_every_tick_is_built_up_only_where_it_is_kept(is_kept):
    dt, speed = 0.002, 0.25
    one = Limiter(AxisLimits(speed=(1.0,), acceleration=(3.0,), jerk=(100.0,)), tick_s=dt)
    places = [0.0, speed * dt, 2.0 * speed * dt]
    one.go_on(*([x] for x in places[-3:]))
    asked = []
    for _ in range(10):  # held at this speed, tick after tick, with the target behind
        one.aim([-0.2])
        asked.append((one.step()[0] - places[-1]) / dt)
        places.append(places[-1] + speed * dt)
        one.go_on(*([x] for x in places[-3:]), is_braking_kept=is_kept)
    assert (asked[-1] < speed - 5.0 * (speed - asked[0])) == is_kept
