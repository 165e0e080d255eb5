import numpy as np
import pytest

from learning.trilateration import relocate

THINGS = np.array([[0.2, 0.05, 0.03], [-0.1, 0.25, 0.05], [-0.2, -0.1, 0.05], [0.1, -0.3, 0.04]])
WEIGHTS = np.ones(4)


def distances_from(places: np.ndarray) -> np.ndarray:
    return np.linalg.norm(THINGS[None] - places[:, None], axis=2)


@pytest.mark.parametrize("keeps_height", [True, False])
def test_distances_tell_where_the_tool_was(keeps_height):
    rng = np.random.default_rng(0)
    places = rng.uniform((-0.2, -0.2, 0.1), (0.2, 0.2, 0.25), (30, 3))
    off = rng.normal(0.0, 0.02, (30, 3)) * (1.0, 1.0, 0.0 if keeps_height else 1.0)
    found = relocate(places + off, distances_from(places), THINGS, WEIGHTS, keeps_height=keeps_height)
    assert found == pytest.approx(places, abs=1e-3)


def test_a_known_height_stays_whatever_the_distances_say():
    places = np.array([[0.05, 0.02, 0.2]])
    found = relocate(places + np.array([0.0, 0.0, 0.05]), distances_from(places), THINGS, WEIGHTS, keeps_height=True)
    assert found[0, 2] == pytest.approx(0.25, abs=1e-6)


def test_what_does_not_count_is_not_looked_at():
    places = np.array([[0.05, 0.02, 0.2]])
    seen = distances_from(places)
    seen[:, 0] += 0.3
    found = relocate(places, seen, THINGS, np.array([0.0, 1.0, 1.0, 1.0]), keeps_height=True)
    assert found == pytest.approx(places, abs=1e-6)


def test_where_nothing_tells_the_place_stays():
    places = np.array([[0.05, 0.02, 0.2]])
    assert relocate(places, distances_from(places) + 0.1, THINGS, np.zeros(4), keeps_height=False) == pytest.approx(
        places
    )
