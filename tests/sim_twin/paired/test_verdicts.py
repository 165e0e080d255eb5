"""What counts as disturbed, on which evidence, and what the bench's rows make of it."""

import numpy as np
import pytest

from sim_twin.paired import Compared, Errand, Kind
from sim_twin.paired.bench import path_results
from sim_twin.paired.curves import Distance
from sim_twin.paired.machine import Spare, spare_share
from sim_twin.paired.wire import why_disturbed

STEP_S, SLICE_S = 0.05, 0.002
N_STEPS = 10


def told(*, longest_s=STEP_S, controller_lost_s=0.0, servo_lost_s=0.0):
    """Return what is said of ten time steps with so much lost."""
    steps_s = np.full(N_STEPS, STEP_S)
    steps_s[3] = longest_s
    n = round((N_STEPS * STEP_S + servo_lost_s) / SLICE_S) + 1
    slices = np.arange(100.0, 100.0 + n)
    stamps_s = 7.0 + SLICE_S * np.arange(n)
    stamps_s[n // 2 :] += controller_lost_s
    times_s = [7.0, *(7.0 + np.cumsum(steps_s)).tolist()]
    return why_disturbed(times_s=times_s, stamps_s=stamps_s, slices=slices, step_s=STEP_S)


def test_an_errand_in_time_is_not_disturbed():
    assert told() is None


@pytest.mark.parametrize(
    ("lost", "most_s", "word"),
    [("longest_s", 0.07, "time step of"), ("controller_lost_s", 0.02, "controller"), ("servo_lost_s", 0.05, "servo")],
)
def test_time_lost_is_borne_up_to_a_limit_and_named_beyond(lost, most_s, word):
    assert told(**{lost: most_s - 0.003}) is None
    assert word in told(**{lost: most_s + 0.003})


def test_the_spare_share_is_what_was_idle_or_waited_for_a_disk():
    assert spare_share((10, 0, 5, 100, 1, 0, 0, 0), (20, 0, 15, 160, 21, 0, 0, 0)) == pytest.approx(0.8)
    assert spare_share((1,) * 8, (1,) * 8) == 1.0


def test_a_processor_kept_busy_is_not_spare():
    spare = Spare().begin()
    n = 0
    while spare.share() == 1.0 and n < 10**7:
        n += 1
    assert 0.0 <= spare.share() < 1.0


def compared(frechet_mm, kind=Kind.MOVES, offset_ms=18.0):
    distance = Distance(
        frechet_m=1e-3 * frechet_mm, offset_s=1e-3 * offset_ms, mean_m=1e-3, stretch_s=0.0, length_m=0.5
    )
    errand = Errand(kind=kind, seed=3, epoch=0, intents=())
    return Compared(errand=errand, distance=distance, start_m=0.0)


def rows_of(found, **counts):
    return {row.name: row for row in path_results(found, **counts)}


def test_one_path_beside_the_goal_misses_it_and_is_named():
    found = [compared(0.4, Kind.PRESS), compared(3.1), compared(2.0, offset_ms=26.0)]
    rows = rows_of(found, n_errands=3, n_sent=4)
    assert rows["frechet_mm_max"].value == pytest.approx(3.1)
    assert not rows["frechet_mm_max"].ok
    assert rows["frechet_mm_max"].details == {"moves": "3.10", "press": "0.40", "worst": "moves of seed 3"}
    assert rows["frechet_mm_p50"].value == pytest.approx(2.0)
    assert rows["offset_ms_p50"].details == {"least": "18", "most": "26"}
    assert (rows["tries_disturbed"].value, rows["tries_disturbed"].unit) == (1.0, "of 4")
    assert all(row.ok for name, row in rows.items() if name != "frechet_mm_max")


def test_fewer_than_half_of_the_errands_prove_nothing():
    assert rows_of([compared(1.0)] * 3, n_errands=6, n_sent=9)["errands_compared"].ok
    assert not rows_of([compared(1.0)] * 2, n_errands=6, n_sent=9)["errands_compared"].ok
    assert not rows_of([], n_errands=6, n_sent=36)["errands_compared"].ok


def test_an_errand_cut_short_on_an_idle_machine_is_a_failure():
    assert not rows_of([compared(1.0)] * 5, n_errands=6, n_sent=9, n_cut_short=1)["errands_cut_short"].ok
