"""What a robot node lets in: boundary by boundary, and whatever comes, nothing twice and nothing of another lease."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.node.admission import AHEAD_NS, DRIFT, Admission

MAX_AGE_NS = 100_000_000


class Clock:
    def __init__(self):
        self.now_ns = 10**12


def made(lease="mine"):
    clock = Clock()
    admission = Admission(max_age_ns=MAX_AGE_NS, now_ns=lambda: clock.now_ns)
    admission.begin(lease)
    return admission, clock


@pytest.mark.parametrize(
    ("age_ns", "is_let_in"),
    [(0, True), (MAX_AGE_NS, True), (MAX_AGE_NS + 1, False), (-AHEAD_NS, True), (-AHEAD_NS - 1, False)],
)
def test_an_age_at_its_limit_is_let_in_and_the_next_nanosecond_is_not(age_ns, is_let_in):
    admission, _ = made()
    why = admission.why_not("mine", 1, stamp_ns=0, age_ns=age_ns)
    assert (why is None) is is_let_in
    assert admission.n_refused == (not is_let_in)


@pytest.mark.parametrize(("late_ns", "is_let_in"), [(0, True), (MAX_AGE_NS, True), (MAX_AGE_NS + 1, False)])
def test_between_two_clocks_how_much_later_than_the_fastest_counts(late_ns, is_let_in):
    admission, clock = made()
    for stamp_ns in (5, -(10**15)):  # wherever the other clock stands
        admission.begin("mine")
        assert admission.why_not("mine", 1, stamp_ns=stamp_ns, age_ns=None) is None
        clock.now_ns += late_ns
        drift_ns = round(DRIFT * late_ns)
        why = admission.why_not("mine", 2, stamp_ns=stamp_ns - drift_ns, age_ns=None)
        assert (why is None) is is_let_in


def test_a_number_that_was_used_is_refused_and_the_next_is_not():
    admission, _ = made()
    assert admission.why_not("mine", 7, stamp_ns=0, age_ns=0) is None
    for number in (7, 6, 0, -1):
        assert admission.why_not("mine", number, stamp_ns=0, age_ns=0).startswith("sequence")
    assert admission.why_not("mine", 8, stamp_ns=0, age_ns=0) is None


def test_a_late_one_uses_no_number_up():
    admission, _ = made()
    assert admission.why_not("mine", 1, stamp_ns=0, age_ns=MAX_AGE_NS + 1).startswith("age")
    assert admission.why_not("mine", 1, stamp_ns=0, age_ns=0) is None


def test_without_a_lease_in_force_nothing_is_let_in():
    admission, _ = made(lease="")
    assert admission.why_not("", 1, stamp_ns=0, age_ns=0).startswith("lease")


LEASES = st.sampled_from(["mine", "another", ""])
COMMANDS = st.tuples(LEASES, st.integers(-3, 20), st.integers(-(10**9), 10**9))


@given(st.lists(COMMANDS, max_size=40))
def test_whatever_comes_what_is_let_in_is_of_the_lease_in_order_and_in_time(commands):
    admission, _ = made()
    taken = [
        (lease, number, age_ns)
        for lease, number, age_ns in commands
        if admission.why_not(lease, number, stamp_ns=0, age_ns=age_ns) is None
    ]
    numbers = [number for _, number, _ in taken]
    assert all(lease == "mine" and -AHEAD_NS <= age_ns <= MAX_AGE_NS for lease, _, age_ns in taken)
    assert numbers == sorted(set(numbers))
    assert admission.n_refused == len(commands) - len(taken)
