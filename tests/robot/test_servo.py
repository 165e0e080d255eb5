import pytest

from robot.servo import lag_s


def test_the_lag_law_meets_the_one_published_measurement():
    assert lag_s(lookahead_s=0.03, gain=1200.0, dead_time_s=0.0035) == pytest.approx(0.034, abs=0.001)


def test_the_lag_grows_with_lookahead_and_dead_time_and_shrinks_with_gain():
    plain = lag_s(lookahead_s=0.05, gain=600.0, dead_time_s=0.004)
    assert lag_s(lookahead_s=0.06, gain=600.0, dead_time_s=0.004) > plain
    assert lag_s(lookahead_s=0.05, gain=600.0, dead_time_s=0.005) > plain
    assert lag_s(lookahead_s=0.05, gain=700.0, dead_time_s=0.004) < plain
