"""The slope of a process's memory is that of a line with a level for each start, and its warming up is no leak."""

import numpy as np
import pytest

from robot.up.slope import WARM_S, MemorySlope


def told(slope, begun_s, seconds, mb_of):
    slope.begin(begun_s)
    for at_s in np.arange(0.0, seconds, 0.5).tolist():
        slope.note(begun_s + at_s, mb_of(at_s))


def test_it_is_the_least_squares_slope_where_there_was_one_start():
    slope, rng = MemorySlope(), np.random.default_rng(0)
    noise = rng.normal(0.0, 2.0, 1000).tolist()
    told(slope, 1e6, 400.0, lambda at_s: 300.0 + 0.01 * at_s + noise[int(2 * at_s)])
    at_s = np.arange(WARM_S, 400.0, 0.5)
    expected = np.polyfit(at_s, 300.0 + 0.01 * at_s + np.array(noise)[60:800], 1)[0]
    assert slope.mb_h == pytest.approx(3600.0 * expected, rel=1e-6)


def test_starts_at_other_levels_do_not_look_like_growth():
    slope = MemorySlope()
    for k in range(5):
        told(slope, 1000.0 * k, 100.0, lambda at_s, k=k: 100.0 * k + 0.001 * at_s)
    assert slope.mb_h == pytest.approx(3.6)


def test_what_is_taken_up_in_the_first_half_minute_does_not_count():
    slope = MemorySlope()
    told(slope, 5.0, WARM_S, lambda at_s: 10.0 * at_s)
    assert slope.mb_h is None
    told(slope, 100.0, 200.0, lambda at_s: min(at_s, WARM_S))
    assert slope.mb_h == pytest.approx(0.0, abs=1e-9)
