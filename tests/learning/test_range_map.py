import numpy as np
import pytest

from learning.range_map import RangeMap

THINGS = np.array([[0.2, 0.05, 0.03], [-0.1, 0.25, 0.05], [-0.2, -0.1, 0.05], [0.1, -0.3, 0.04], [0.0, 0.1, 0.03]])
ALL = np.ones(len(THINGS), dtype=bool)
START = np.array([0.0, 0.0, 0.2])


def distances(place: np.ndarray, things: np.ndarray = THINGS) -> np.ndarray:
    return np.linalg.norm(things - place, axis=1)


def begun(rng: np.random.Generator, *, off_m: float = 0.03, std_m: float = 0.03, height: bool = True) -> RangeMap:
    """A history begun with a guess some centimetres off."""
    guess = THINGS - START + rng.normal(0.0, off_m / np.sqrt(3.0), THINGS.shape)
    std = np.full(len(THINGS), std_m)
    mapped = RangeMap(guess, std, height_m=START[2], is_thing=ALL, window=20)
    mapped.see(distances(START), START[2] if height else None)
    return mapped


def walk(rng: np.random.Generator, n_steps: int = 40) -> np.ndarray:
    """Steps of 2 cm on a winding way, (n, 3)."""
    headings = np.cumsum(rng.normal(0.0, 0.5, n_steps)) + rng.uniform(0.0, 2.0 * np.pi)
    return 0.02 * np.column_stack([np.cos(headings), np.sin(headings), rng.normal(0.0, 0.1, n_steps)])


def follow(mapped: RangeMap, steps: np.ndarray, rng: np.random.Generator, *, height: bool = True) -> np.ndarray:
    """Take the steps, each told a third too long or too short; return where the tool is."""
    place = START.copy()
    for step in steps:
        place = place + step
        mapped.move(step * rng.uniform(0.67, 1.33), 0.01)
        mapped.see(distances(place), place[2] if height else None)
    return place


def wrong_m(mapped: RangeMap, place: np.ndarray) -> np.ndarray:
    """Errors of the displacements from the tool to the things, (n,)."""
    return np.linalg.norm(mapped.things_m - mapped.place_m - (THINGS - place), axis=1)


@pytest.mark.parametrize(
    ("height", "share", "most"), [(True, 0.5, 0.03), (False, 0.85, 0.05)], ids=["height measured", "no height"]
)
def test_a_winding_way_betters_the_guess_of_where_everything_is(height, share, most):
    """What stays is for the most part one turn of the whole map: distances know no north, only intents do."""
    before, after = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        mapped = begun(rng, height=height)
        before.append(wrong_m(mapped, START))
        after.append(wrong_m(mapped, follow(mapped, walk(rng), rng, height=height)))
    assert np.mean(after) < share * np.mean(before)
    assert np.max(after) < most


def test_without_any_idea_of_bearings_ways_begin_to_tell_them():
    """Guesses of nothing at all are wrong by the whole distance; after a winding way by less than half of it."""
    shares = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        n = len(THINGS)
        mapped = RangeMap(np.zeros((n, 3)), np.full(n, 0.3), height_m=START[2], is_thing=ALL, window=20)
        mapped.see(distances(START), START[2])
        place = follow(mapped, walk(rng, 60), rng)
        shares.append(wrong_m(mapped, place) / distances(place))
    assert np.median(shares) < 0.5


def test_errors_are_no_greater_than_it_says():
    squares = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        mapped = begun(rng)
        place = follow(mapped, walk(rng, 25), rng)
        squares.append(wrong_m(mapped, place) ** 2 / (3.0 * mapped.doubt_m2()))
    assert np.mean(squares) < 1.0


def test_a_right_guess_stays_right():
    rng = np.random.default_rng(1)
    mapped = begun(rng, off_m=0.0)
    assert wrong_m(mapped, follow(mapped, walk(rng), rng)).max() < 0.01


def test_a_distance_along_the_ray_by_hand():
    # Guessed 0.4 m ahead, give or take 0.1 m, and seen 0.5 m off. Across the ray 2 * 0.01 m^2 may bend the distance by
    # 0.02 / (2 * 0.5) = 0.02 m, so the gain is 0.01 / (0.01 + 0.02^2 + 0.001^2).
    mapped = RangeMap(np.array([[0.4, 0.0, 0.0]]), np.array([0.1]), height_m=0.0, is_thing=np.array([True]), window=20)
    mapped.see(np.array([0.5]), None)
    assert mapped.things_m[0] - mapped.place_m == pytest.approx([0.4 + 0.1 * 0.01 / 0.010401, 0.0, 0.0], abs=1e-6)


def test_a_tool_that_was_held_up_is_found_where_it_stayed():
    rng = np.random.default_rng(3)
    mapped = begun(rng, off_m=0.01, std_m=0.01)
    place = follow(mapped, walk(rng, 20), rng)
    before = mapped.place_m.copy()
    for _ in range(5):
        mapped.move(np.array([0.02, 0.0, 0.0]), 0.012)
        mapped.see(distances(place), place[2])
    assert np.linalg.norm(mapped.place_m - before) < 0.003
    assert mapped.rested.all()


def test_a_thing_that_was_pushed_is_told_from_those_that_rest():
    rng = np.random.default_rng(4)
    mapped = begun(rng, off_m=0.01, std_m=0.01)
    place = follow(mapped, walk(rng, 20), rng)
    before = mapped.things_m.copy()
    things = THINGS.copy()
    things[2] += (0.0, 0.06, 0.0)
    mapped.move(np.zeros(3), 0.002)
    mapped.see(distances(place, things), place[2])
    assert mapped.rested.tolist() == [True, True, False, True, True]
    assert np.abs(mapped.things_m - before)[mapped.rested].max() < 0.003


def test_what_is_carried_comes_along_until_it_is_let_go():
    rng = np.random.default_rng(5)
    mapped = begun(rng, off_m=0.01, std_m=0.01)
    place = THINGS[4] + (0.0, 0.0, 0.01)
    mapped.move(place - START, 0.02)
    mapped.see(distances(place), place[2])
    things = THINGS.copy()
    for k in range(30):
        step = np.array([0.0, 0.0, 0.01]) if k < 8 else np.array([0.02, 0.005, 0.0])
        place = place + step
        if k < 20:
            things[4] += step
        mapped.move(step, 0.004)
        mapped.see(distances(place, things), place[2])
        if k in (6, 19):
            assert mapped.carried.tolist() == [False] * 4 + [True]
    assert not mapped.carried.any()
    assert mapped.rested.tolist() == [True] * 4 + [False]
    assert np.linalg.norm(mapped.things_m[4] - mapped.place_m - (things[4] - place)) < 0.05


def test_nothing_at_rest_is_ever_taken_to_come_along():
    for seed in range(10):
        rng = np.random.default_rng(seed)
        mapped = begun(rng, off_m=0.01, std_m=0.01)
        follow(mapped, walk(rng, 60), rng)
        assert not mapped.carried.any()


def test_entries_that_are_no_things_are_never_looked_at():
    results = []
    for value in (0.1, 9.0):
        rng = np.random.default_rng(6)
        guess = np.vstack([THINGS - START, np.ones((1, 3))])
        is_thing = np.array([True] * len(THINGS) + [False])
        mapped = RangeMap(guess, np.full(6, 0.03), height_m=START[2], is_thing=is_thing, window=20)
        place = START.copy()
        for step in walk(rng, 10):
            place = place + step
            mapped.move(step, 0.005)
            mapped.see(np.append(distances(place), value), place[2])
        results.append((mapped.place_m.copy(), mapped.things_m[:-1].copy()))
    assert (results[0][0] == results[1][0]).all()
    assert (results[0][1] == results[1][1]).all()
