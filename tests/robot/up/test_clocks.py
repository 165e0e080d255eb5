"""Offsets of other machines' clocks: never farther off than is said, and the narrowest bound there is."""

import numpy as np
import pytest

from robot.bus.watch import Answer
from robot.up.clocks import DRIFT, GONE_S, ClockBook


class Book:
    """A book whose clock stands where it is told."""

    def __init__(self):
        self.now_ns = 10**12
        self.book = ClockBook(now_ns=lambda: self.now_ns)

    def say(self, offset_ms, within_ms, *, is_same_clock=False):
        answer = Answer(
            source="robot", role="robot", round_trip_ms=2 * within_ms, is_same_clock=is_same_clock,
            offset_ms=offset_ms, offset_within_ms=within_ms,
        )  # fmt: skip
        self.book.take((answer,))

    def told(self):
        (offset,) = self.book.offsets()
        return offset


@pytest.mark.parametrize("seed", range(10))
def test_the_true_offset_lies_within_what_is_said_however_uneven_the_ways_are(seed):
    rng = np.random.default_rng(seed)
    told, true_ms = Book(), 5e4 * rng.standard_normal()
    rate = rng.uniform(-DRIFT, DRIFT)
    for _ in range(60):
        there_ms, back_ms = rng.exponential(3.0, 2)
        error_ms = (there_ms - back_ms) / 2
        told.say(true_ms + error_ms, (there_ms + back_ms) / 2)
        found = told.told()
        assert abs(found.offset_ms - true_ms) <= found.within_ms + 1e-9
        told.now_ns += 2_000_000_000
        true_ms += rate * 2000.0


def test_the_narrowest_answer_counts_until_time_has_made_it_wide():
    told = Book()
    told.say(10.0, 0.1)
    told.now_ns += 1_000_000_000
    told.say(10.5, 5.0)
    assert (told.told().offset_ms, told.told().within_ms) == (10.0, pytest.approx(0.1 + DRIFT * 1e3))
    told.now_ns += 25_000_000_000
    told.say(10.9, 0.4)
    assert told.told().offset_ms == 10.9


def test_a_machine_that_was_started_anew_has_another_clock():
    told = Book()
    told.say(10.0, 0.1)
    told.say(-4000.0, 3.0)
    assert told.told().offset_ms == -4000.0
    told.say(0.0, 3.0, is_same_clock=True)
    assert told.told().is_same_clock


@pytest.mark.parametrize(("later_s", "n"), [(GONE_S, 1), (GONE_S + 1e-6, 0)])
def test_a_process_that_answers_no_more_is_told_no_more(later_s, n):
    told = Book()
    told.say(10.0, 0.1)
    told.now_ns += round(later_s * 1e9)
    assert len(told.book.offsets()) == n
