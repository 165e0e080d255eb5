"""Numbers alone tell what was lost, came twice or was overtaken, against a plain reckoning over whole sets."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.bus.sequence import WINDOW, Arrival, SequenceWindow

NEW, REORDERED, DUPLICATE = Arrival.NEW, Arrival.REORDERED, Arrival.DUPLICATE


def notes(sequences):
    window = SequenceWindow()
    return [window.note(sequence) for sequence in sequences], window.n_lost


@given(st.lists(st.integers(0, WINDOW // 2), min_size=1, max_size=60))
def test_any_order_with_any_losses_and_repeats_is_told_as_it_was(sequences):
    arrivals, n_lost = notes(sequences)
    seen, newest = set(), -1
    for sequence, arrival in zip(sequences, arrivals, strict=True):
        wanted = DUPLICATE if sequence in seen else NEW if sequence > newest else REORDERED
        assert arrival is wanted
        seen.add(sequence)
        newest = max(newest, sequence)
    first = sequences[0]
    assert n_lost == len(set(range(first, newest)) - seen)


@given(st.integers(0, 2**64 - 2**20), st.permutations(range(20)))
def test_what_was_only_overtaken_is_not_lost(begin, order):
    arrivals, n_lost = notes([begin, *(begin + 1 + k for k in order)])
    assert n_lost == 0
    assert DUPLICATE not in arrivals


@pytest.mark.parametrize(
    ("back", "arrival"), [(1, REORDERED), (WINDOW - 1, REORDERED), (WINDOW, DUPLICATE), (WINDOW + 1, DUPLICATE)]
)
def test_so_far_back_a_message_is_told_from_a_repeat(back, arrival):
    newest = 5 * WINDOW
    arrivals, n_lost = notes([0, newest, newest - back])
    assert arrivals[-1] is arrival
    assert n_lost == newest - 1 - (arrival is REORDERED)


@pytest.mark.parametrize("gap", [1, 2, WINDOW - 1, WINDOW, WINDOW + 1, 2**63])
def test_a_gap_of_any_length_is_counted_and_takes_no_memory(gap):
    window = SequenceWindow()
    window.note(0)
    assert window.note(gap) is NEW
    assert window.n_lost == gap - 1
    assert window._seen.bit_length() <= WINDOW
    assert window.note(gap) is DUPLICATE
    assert window.note(0) is DUPLICATE


def test_what_was_written_before_the_first_that_came_is_not_missed():
    assert notes([7, 8, 5]) == ([NEW, NEW, REORDERED], 0)
    assert notes([7, 8, 5, 5]) == ([NEW, NEW, REORDERED, DUPLICATE], 0)
