"""What a push bent joints by fades from rest to rest, and an arm with short ticks rises from where it was pushed."""

import numpy as np
import pytest

from config.loader import load_arm
from robot.motion.lean import FADE_S, Lean

HOME = load_arm("ur5e").home_rad
BENT = tuple(q + d for q, d in zip(HOME, (0.0002, 0.005, -0.008, 0.012, -0.0003, 0.0003), strict=True))


def faded(tick_s):
    lean = Lean(tick_s=tick_s)
    lean.begin(BENT, HOME)
    ways = [BENT, BENT, BENT]
    while not lean.is_over:
        ways.append(lean.step(HOME))
    return np.array([*ways, HOME, HOME, HOME])


@pytest.mark.parametrize("tick_s", [0.002, 0.004])
def test_it_ends_at_the_upright_joints_in_its_time_and_never_beyond_them(tick_s):
    ways = faded(tick_s)
    assert len(ways) == 6 + round(FADE_S / tick_s)
    share = (ways - HOME)[:, 3] / 0.012
    assert (np.diff(share) <= 1e-12).all()
    assert share[-4] == 0.0


def test_it_begins_and_ends_at_rest_and_changes_speed_gently():
    rates = np.diff(faded(0.002), axis=0) / 0.002
    gains = np.diff(rates, axis=0) / 0.002
    assert np.abs(rates[[0, 1, 2, -1, -2]]).max() < 1e-3
    assert np.abs(gains).max() < 0.5
    assert np.abs(np.diff(gains, axis=0) / 0.002).max() < 15.0


def test_without_a_difference_or_upright_joints_there_is_nothing_to_let_go_of():
    lean = Lean(tick_s=0.002)
    for upright in (HOME, None):
        lean.begin(HOME, upright)
        assert lean.is_over


def test_it_begins_anew_from_where_joints_are():
    lean = Lean(tick_s=0.002)
    lean.begin(BENT, HOME)
    for _ in range(100):
        at = lean.step(HOME)
    lean.begin(at, HOME)
    assert np.abs(np.subtract(lean.step(HOME), at)).max() < 1e-6
