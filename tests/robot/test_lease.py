"""One source at a time, for as long as it says that it is there."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.errors import SafetyError
from robot.safety import LeaseBook
from tests.support.words import HostTime

LIFE_NS = 1_000_000_000


@pytest.fixture
def host():
    return HostTime()


@pytest.fixture
def book(host):
    return LeaseBook(now_ns=host)


def test_a_source_has_it_and_another_does_not_get_it(book):
    lease = book.take("teleop", life_ns=LIFE_NS)
    assert book.current == lease
    with pytest.raises(SafetyError, match="teleop has it"):
        book.take("learner")
    assert book.current == lease


def test_no_name_no_lease(book):
    with pytest.raises(SafetyError, match="name"):
        book.take("")
    lease = book.take("teleop")
    with pytest.raises(SafetyError, match="name"):
        book.hand_over(lease, "")
    assert book.current == lease


@pytest.mark.parametrize(
    ("after_ns", "holds"), [(0, True), (LIFE_NS, True), (LIFE_NS + 1, False), (-1, False), (10 * LIFE_NS, False)]
)
def test_it_holds_at_its_last_nanosecond_and_not_at_the_next(book, host, after_ns, holds):
    lease = book.take("teleop", life_ns=LIFE_NS)
    host.now_ns += after_ns
    assert book.is_in_force(lease) is holds
    assert (book.current is not None) is holds


def test_a_renewed_lease_lives_on_and_an_expired_one_is_not_renewed(book, host):
    lease = book.take("teleop", life_ns=LIFE_NS)
    for _ in range(5):
        host.now_ns += LIFE_NS
        book.renew(lease)
    host.now_ns += LIFE_NS + 1
    with pytest.raises(SafetyError, match="expired"):
        book.renew(lease)
    with pytest.raises(SafetyError, match="expired"):
        book.hand_over(lease, "learner")
    assert book.take("learner").source == "learner"


def test_a_lease_without_a_life_does_not_expire(book, host):
    lease = book.take("local")
    host.now_ns += 10**18
    assert book.is_in_force(lease)


def test_after_a_hand_over_the_old_lease_is_worth_nothing(book):
    old = book.take("teleop")
    new = book.hand_over(old, "learner")
    assert book.current == new
    assert not book.is_in_force(old)
    for ask in (book.renew, book.revive, lambda lease: book.hand_over(lease, "teleop")):
        with pytest.raises(SafetyError, match="has ended; learner has it"):
            ask(old)
    book.release(old)
    assert book.current == new


def test_what_is_let_go_of_is_free_and_the_same_source_gets_another_number(book):
    lease = book.take("teleop")
    book.release(lease)
    assert book.current is None
    with pytest.raises(SafetyError, match="nobody has it"):
        book.renew(lease)
    assert book.take("teleop").number != lease.number


def test_an_expired_lease_may_be_taken_up_again_unless_another_was_given(book, host):
    lease = book.take("teleop", life_ns=LIFE_NS)
    host.now_ns += 2 * LIFE_NS
    book.revive(lease)
    assert book.is_in_force(lease)


@given(st.lists(st.tuples(st.sampled_from(["take", "hand", "release", "wait", "renew"]), st.sampled_from("ab"))))
def test_there_is_never_more_than_one_lease_in_force(events):
    host = HostTime()
    book, given_out = LeaseBook(now_ns=host), []
    for what, source in events:
        try:
            if what == "take":
                given_out.append(book.take(source, life_ns=LIFE_NS))
            elif what == "wait":
                host.now_ns += LIFE_NS // 2 + 1
            elif given_out and what == "hand":
                given_out.append(book.hand_over(given_out[-1], source, life_ns=LIFE_NS))
            elif given_out and what == "renew":
                book.renew(given_out[-1])
            elif given_out:
                book.release(given_out[-1])
        except SafetyError:
            pass
        in_force = {lease.number for lease in given_out if book.is_in_force(lease)}
        assert len(in_force) <= 1
        assert len({lease.number for lease in given_out}) == len(given_out)
