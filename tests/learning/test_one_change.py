"""What comes to each conjunction from those one change apart, by both ways."""

import numpy as np
import pytest

from learning.one_change import LISTED, by_common_parts, by_neighbours, one_change
from learning.preconditions import conjunctions, one_change_apart


def both(n_goals, max_literals, goal=1):
    needs = list(conjunctions(n_goals, goal, max_literals))
    index_of = {each: i for i, each in enumerate(needs)}
    apart = [[index_of[n] for n in one_change_apart(each, n_goals, goal, max_literals)] for each in needs]
    return needs, apart, by_neighbours(apart), by_common_parts(needs, n_others=n_goals - 1, max_literals=max_literals)


def test_two_goals_by_hand():
    """Nothing, on, off: each is one change from the two others."""
    *_, listed, summed = both(2, 1, goal=0)
    for way in (listed, summed):
        assert way.n_changes.tolist() == [2, 2, 2]
        assert way.arriving(np.array([1.0, 2.0, 4.0])) == pytest.approx([6.0, 5.0, 3.0])


@pytest.mark.parametrize(("n_goals", "max_literals"), [(2, 1), (3, 1), (4, 2), (4, 3), (5, 3), (6, 4), (3, 4), (1, 2)])
def test_both_ways_come_to_the_same(n_goals, max_literals):
    needs, _, listed, summed = both(n_goals, max_literals, goal=0)
    assert summed.n_changes.tolist() == listed.n_changes.tolist()
    rng = np.random.default_rng(n_goals)
    for _ in range(5):
        leaving = rng.random(len(needs)) ** 8
        assert summed.arriving(leaving) == pytest.approx(listed.arriving(leaving), rel=1e-9, abs=1e-12)


def test_nothing_negative_comes_however_it_rounds():
    needs, _, _, summed = both(5, 3)
    leaving = np.where(np.arange(len(needs)) % 7, 0.0, 1e-3 / 3.0)
    assert summed.arriving(leaving).min() >= 0.0


def test_neighbours_are_asked_of_few_only():
    needs = list(conjunctions(4, 0, 2))
    asked = []

    def neighbours(i):
        asked.append(i)
        return [0]

    one_change(needs, neighbours, n_others=3, max_literals=2)
    assert asked == list(range(len(needs)))
    many = list(conjunctions(14, 0, 3))
    assert len(many) > LISTED
    one_change(many, neighbours, n_others=13, max_literals=3)
    assert len(asked) == len(needs)
