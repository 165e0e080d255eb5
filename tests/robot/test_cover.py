"""A share of a way is called free only where a gap that was found proves it."""

import math

import numpy as np
import pytest

from config.loader import load_arm
from robot.geometry import between, difference, stepped
from robot.safety.cover import N_SEEN, covered_share, nothing_seen
from robot.safety.sweep import Sweep

ARM = load_arm("ur5e")
SWEEP, HOME = Sweep(ARM), load_arm("ur5e").home_rad
TURN = (0.05, -0.04, 0.06, 0.03, 0.02, -0.1)
END = stepped(HOME, TURN, 1.0)
LENGTH_M = SWEEP.bound_m(TURN)


def seen(*found):
    rows = nothing_seen()
    for row, (q, gap_m) in zip(rows, found, strict=False):
        row[:] = (*q, gap_m)
    return rows


def covered(rows, q=HOME, end=END):
    return float(covered_share(q, end, SWEEP.bound_m(difference(end, q)), rows, SWEEP.far_m, SWEEP.links_m))


def bound_m(rows, x):
    """Return what the gaps prove at joints, each by itself."""
    return max(row[6] - SWEEP.bound_m(difference(tuple(row[:6].tolist()), x)) for row in rows)


def test_with_nothing_seen_nothing_is_proved():
    assert covered(nothing_seen()) == 0.0


@pytest.mark.parametrize(("share", "needed"), [(0.0, 1.0), (0.5, 0.5), (0.25, 0.75), (1.0, 1.0)])
@pytest.mark.parametrize(("more", "is_whole"), [(1e-9, True), (-1e-9, False)])
def test_a_gap_on_the_way_proves_as_much_of_it_to_either_side_and_no_more(share, needed, more, is_whole):
    at = between(HOME, END, share)
    assert (covered(seen((at, needed * LENGTH_M + more))) > 1.0) is is_whole


@pytest.mark.parametrize(("more", "is_whole"), [(1e-9, True), (-1e-9, False)])
def test_a_gap_beside_or_behind_the_way_proves_less_by_how_far_it_is(more, is_whole):
    behind = between(HOME, END, -0.3)
    assert (covered(seen((behind, 1.3 * LENGTH_M + more))) > 1.0) is is_whole
    beyond = between(HOME, END, 1.2)
    assert (covered(seen((beyond, 1.2 * LENGTH_M + more))) > 1.0) is is_whole


def test_gaps_prove_a_way_together_where_they_overlap_and_up_to_a_hole_otherwise():
    first, last = (HOME, 0.6 * LENGTH_M), (END, 0.5 * LENGTH_M)
    assert covered(seen(last, first)) > 1.0
    assert covered(seen((END, 0.3 * LENGTH_M), first)) == pytest.approx(0.6)
    assert covered(seen(last)) == 0.0


@pytest.mark.parametrize("gap_m", [0.0, -0.01, math.nan, -math.inf])
def test_a_gap_that_is_none_proves_nothing(gap_m):
    assert covered(seen((HOME, gap_m))) == 0.0


def test_an_arm_that_goes_nowhere_is_free_where_a_gap_was_found():
    assert covered(seen((HOME, 1e-6)), HOME, HOME) > 1.0
    assert covered(nothing_seen(), HOME, HOME) == 0.0


@pytest.mark.parametrize("seed", range(40))
def test_wherever_a_way_is_called_free_a_gap_proves_it(seed):
    rng = np.random.default_rng(seed)
    n_proved = 0
    for _ in range(25):
        turn = rng.normal(size=6) * rng.choice([1e-3, 0.02, 0.1])
        q = stepped(HOME, tuple(rng.normal(size=6).tolist()), 0.01)
        end = stepped(q, tuple(turn.tolist()), 1.0)
        length_m = SWEEP.bound_m(difference(end, q))
        found = [
            (
                stepped(between(q, end, float(rng.uniform(-0.5, 1.5))), tuple(rng.normal(size=6).tolist()), 0.003),
                float(rng.uniform(-0.1, 1.0)) * length_m,
            )
            for _ in range(rng.integers(1, N_SEEN + 1))
        ]
        rows = seen(*found)
        reached = covered(rows, q, end)
        n_proved += reached > 0.0
        for share in np.linspace(0.0, min(1.0, reached), 30):
            if share < reached:
                assert bound_m(rows, between(q, end, float(share))) > -1e-12
    assert n_proved > 3
