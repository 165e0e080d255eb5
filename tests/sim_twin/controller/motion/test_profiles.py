import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.motion.profiles import Residual, Trapezoid


# distance, v, a, t -> duration, peak; by hand
@pytest.mark.parametrize(
    ("distance", "v", "a", "t", "duration", "peak"),
    [
        (1.0, 0.5, 1.0, 0.0, 2.5, 0.5),  # 0.5 s up, 1.5 s at 0.5, 0.5 s down
        (0.25, 1.0, 1.0, 0.0, 1.0, 0.5),  # a triangle
        (1.0, 1.0, 1.0, 0.0, 2.0, 1.0),  # just reaches v
        (1.0, 0.5, 1.0, 4.0, 4.0, 2.0 - 3.0**0.5),  # v solves v² - 4 v + 1 = 0
        (1.0, 9.0, 0.1, 1.0, 1.0, 2.0),  # a is too low: a triangle of 4 d / t²
        (0.0, 1.0, 1.0, 3.0, 0.0, 0.0),
    ],
)
def test_a_profile_worked_by_hand(distance, v, a, t, duration, peak):
    profile = Trapezoid(distance, v=v, a=a, duration_s=t)
    assert (profile.duration_s, profile.v) == pytest.approx((duration, peak))
    assert profile.at(duration)[0] == pytest.approx(distance)
    assert profile.at(duration / 2)[0] == pytest.approx(distance / 2)


@given(st.floats(1e-4, 5.0), st.floats(0.01, 3.0), st.floats(0.1, 40.0))
def test_distance_is_the_sum_of_speed_and_speed_of_acceleration(distance, v, a):
    profile = Trapezoid(distance, v=v, a=a)
    at = np.array([profile.at(t) for t in np.linspace(0.0, profile.duration_s, 4001)])
    dt = profile.duration_s / 4000
    assert np.trapezoid(at[:, 1], dx=dt) == pytest.approx(distance, rel=1e-3)
    assert np.abs(np.diff(at[:, 1])).max() <= a * dt * (1 + 1e-6)
    assert at[:, 1].max() <= v + 1e-12


@pytest.mark.parametrize(("v", "a"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, float("nan"))])
def test_a_speed_or_acceleration_that_is_none_is_refused(v, a):
    with pytest.raises(ValueError, match="expected distance"):
        Trapezoid(1.0, v=v, a=a)


def test_a_residual_over_twice_offset_by_speed_is_a_parabola():
    offset, speed = np.array([-0.1, 0, 0, 0, 0, 0]), np.array([0.5, 0, 0, 0, 0, 0])
    residual = Residual(offset, speed, 0.4)
    for t in (0.0, 0.1, 0.3):
        at = residual.at(t)
        assert at is not None
        assert at[0][0] == pytest.approx(-0.1 * (1 - t / 0.4) ** 2)
        assert at[1][0] == pytest.approx(0.5 * (1 - t / 0.4))
    assert residual.at(0.4) is None
