import numpy as np
import pytest

from learning.trilateration import MOST_SEEN, bearings, comes_along, share_moved

THINGS = np.array([[0.1, 0.05, -0.1], [-0.2, 0.1, -0.15], [0.02, -0.01, -0.02]])


def distances_from(places: np.ndarray) -> np.ndarray:
    """Distances of the things from places, both seen from where the tool is now, (t, n)."""
    return np.linalg.norm(THINGS[None] - places[:, None], axis=2)


def walk(rng: np.random.Generator) -> np.ndarray:
    """Where the tool was in the last twenty time steps, seen from where it is."""
    return -np.cumsum(rng.normal(0.0, 0.015, (20, 3)), axis=0)[::-1]


@pytest.mark.parametrize("seed", range(6))
def test_a_winding_way_tells_where_near_things_are_and_betters_the_guess_of_far_ones(seed):
    x = walk(np.random.default_rng(seed))
    away = np.linalg.norm(THINGS, axis=1)
    wrong = np.linalg.norm(bearings(x, distances_from(x), away, np.zeros((3, 3))) - THINGS, axis=1)
    assert wrong[2] < 0.1 * away[2]
    assert (wrong < 0.9 * away).all()


def test_a_right_guess_stays_right():
    x = walk(np.random.default_rng(1))
    o = bearings(x, distances_from(x), np.linalg.norm(THINGS, axis=1), THINGS)
    assert o == pytest.approx(THINGS, abs=1e-9)


def test_without_any_past_the_guess_is_all_there_is():
    guess = np.arange(9.0).reshape(3, 3)
    o = bearings(np.zeros((0, 3)), np.zeros((0, 3)), np.linalg.norm(THINGS, axis=1), guess)
    assert o == pytest.approx(guess)


def test_bearings_along_one_axis_by_hand():
    # The tool came 0.1 m along x; a thing straight ahead was 0.5 and is 0.4 m off: x.o = (0.16 + 0.01 - 0.25) / 2.
    o = bearings(np.array([[-0.1, 0.0, 0.0]]), np.array([[0.5]]), np.array([0.4]), np.zeros((1, 3)))
    weight = 1.0 / (1.0 + 1.0 / 6.0) ** 2
    doubt = 0.05 * 0.16 + 1e-6
    assert o[0] == pytest.approx([weight * 0.1 * 0.04 / (weight * 0.01 + doubt), 0.0, 0.0])


def test_what_stayed_near_while_the_tool_went_far_came_along():
    x = np.array([[-0.1, 0.0, 0.0]])
    assert comes_along(x, np.array([[0.01, 0.30]]), np.array([0.01, 0.25])).tolist() == [True, False]


def test_nothing_at_rest_is_ever_taken_to_have_come_along():
    for seed in range(20):
        x = walk(np.random.default_rng(seed))
        assert not comes_along(x, distances_from(x), np.linalg.norm(THINGS, axis=1)).any()


@pytest.mark.parametrize(
    ("change", "share"), [(0.0, 0.0), (0.01 * MOST_SEEN, 0.5), (0.02 * MOST_SEEN, 1.0), (0.1, 1.0)]
)
def test_a_tool_moved_no_further_than_distances_show(change, share):
    before = np.array([0.3, 0.2])
    assert share_moved(np.array([0.02, 0.0, 0.0]), before, before - (change, 0.0)) == pytest.approx(share)


def test_a_step_too_small_to_tell_is_taken_as_expected():
    before = np.array([0.3])
    assert share_moved(np.array([0.001, 0.0, 0.0]), before, before) == 1.0
