"""Distances of paths, against cases worked by hand."""

import numpy as np
import pytest

from sim_twin.paired.curves import Track, compare, discrete_frechet_m, even_points


def frechet_by_definition(first, second):
    table = np.full((len(first), len(second)), np.inf)
    for i, p in enumerate(first):
        for j, q in enumerate(second):
            before = [table[a, b] for a, b in ((i - 1, j), (i, j - 1), (i - 1, j - 1)) if a >= 0 and b >= 0]
            table[i, j] = max(np.linalg.norm(p - q), min(before, default=-np.inf))
    return table[-1, -1]


@pytest.mark.parametrize(("n", "m"), [(1, 1), (1, 5), (5, 1), (7, 4), (4, 7), (12, 12)])
def test_the_distance_by_diagonals_is_the_one_by_definition(n, m):
    rng = np.random.default_rng([n, m])
    first, second = rng.normal(size=(n, 3)), rng.normal(size=(m, 3))
    assert discrete_frechet_m(first, second) == pytest.approx(frechet_by_definition(first, second), abs=1e-12)
    assert discrete_frechet_m(first, second) == discrete_frechet_m(second, first)


def test_a_parallel_line_is_as_far_as_it_lies_apart_and_a_detour_as_far_as_it_leads():
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    bent = np.array([[0.0, 0.0, 0.0], [0.5, 0.02, 0.0], [1.0, 0.0, 0.0]])
    there_and_back = np.array([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]])
    apart = discrete_frechet_m(even_points(line), even_points(line + np.array([0.0, 0.01, 0.0])))
    assert apart == pytest.approx(0.01, abs=1e-6)
    assert discrete_frechet_m(even_points(line), even_points(bent)) == pytest.approx(0.02, abs=5e-4)
    assert discrete_frechet_m(even_points(line), even_points(there_and_back)) == pytest.approx(0.1, abs=5e-4)


def test_the_same_path_later_is_no_distance_and_its_delay_is_told():
    t = np.arange(0.0, 2.0, 0.002)
    p = np.stack([np.sin(t), np.cos(2 * t), 0.1 * t], axis=1)
    late = np.vstack([np.repeat(p[:1], 30, axis=0), p])
    found = compare(Track(t_s=t, p_m=p), Track(t_s=np.arange(len(late)) * 0.002, p_m=late))
    assert found.frechet_m < 1e-6
    assert found.offset_s == pytest.approx(0.06, abs=1.5e-3)
    assert found.mean_m < 1e-3
    assert found.stretch_s == pytest.approx(0.06)
