"""The same intents, in lock-step and through servo process, client and controller, lead the tool along one path."""

import pytest

from sim_twin.paired import DisturbedError, Kind, Pair
from sim_twin.paired.bench import path_results

FRECHET_M = {Kind.MOVES: 8e-3, Kind.DESCENT: 3e-3, Kind.PRESS: 3e-3}
"""Corners at full speed are cut by more or less with the tick and an intent's delay: docs/virtual-controller.md."""
OFFSET_S = 0.06


@pytest.fixture(scope="module")
def pair():
    with Pair("127.0.0.72") as opened:
        yield opened


def run(pair, kind, seed):
    try:
        return pair.run(kind, seed=seed)
    except DisturbedError as error:
        pytest.skip(f"this machine is too busy to keep a controller's pace: {error}")


def check(compared):
    distance = compared.distance
    assert compared.start_m < 1e-4
    assert distance.length_m > 0.1
    assert distance.frechet_m <= FRECHET_M[compared.errand.kind]
    assert abs(distance.offset_s) <= OFFSET_S


def test_the_tool_takes_the_lock_step_twins_path_over_the_wire(pair):
    compared = run(pair, Kind.DESCENT, seed=7)
    check(compared)
    rows = {row.name: row for row in path_results([compared], n_errands=1, n_tries=3)}
    assert rows["frechet_mm_max"].ok
    assert rows["tries_disturbed"].value == 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", Kind)
def test_every_errand_takes_the_lock_step_twins_path(pair, kind, seed):
    check(run(pair, kind, seed=10 + seed))
