import numpy as np
import pytest

from learning.boredom import Boredom


def bored(**kw: float) -> Boredom:
    return Boredom(2, height=kw.get("height", 0.1), sigma=kw.get("sigma", 0.5))


def test_nothing_bores_at_first():
    assert bored().of(np.ones((3, 2), dtype=np.float32)).tolist() == [0.0, 0.0, 0.0]


def test_boredom_by_hand():
    boredom = bored()
    boredom.add(np.array([0.0, 0.0], dtype=np.float32), n_still=0)
    boredom.add(np.array([1.0, 0.0], dtype=np.float32), n_still=2)
    # At (0, 0): 0.1 * 1 + 0.1 * 3 * exp(-1 / (2 * 0.25)); at (0, 1): 0.1 * exp(-2) + 0.3 * exp(-4).
    expected = [0.1 + 0.3 * np.exp(-2.0), 0.1 * np.exp(-2.0) + 0.3 * np.exp(-4.0)]
    taken = boredom.of(np.array([[0.0, 0.0], [0.0, 1.0]], dtype=np.float32))
    assert taken.tolist() == pytest.approx(expected, rel=1e-5)


def test_a_trial_longer_than_the_first_store_is_remembered_whole():
    boredom, place = bored(), np.array([[0.2, 0.3]], dtype=np.float32)
    for _ in range(150):
        boredom.add(place[0], n_still=0)
    assert boredom.of(place)[0] == pytest.approx(150 * 0.1, rel=1e-4)


def test_a_new_trial_has_forgotten_everything():
    boredom, place = bored(), np.array([[0.2, 0.3]], dtype=np.float32)
    boredom.add(place[0], n_still=5)
    boredom.begin()
    assert boredom.of(place).tolist() == [0.0]


def test_boredom_of_height_nought_takes_nothing():
    boredom, place = bored(height=0.0), np.array([[0.2, 0.3]], dtype=np.float32)
    boredom.add(place[0], n_still=5)
    assert boredom.of(place).tolist() == [0.0]
