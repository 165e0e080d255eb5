"""A learner's account reaches a recorder whole and in order, whatever the link does to it, and whoever is killed."""

import numpy as np
import pytest

from robot.bus.account_rows import AccountPart, AccountWritten
from robot.recording.account import AGAIN_NS, DEAF_NS, MOST_BYTES, Account
from robot.recording.account_order import MOST_AHEAD, AccountOrder

ACCOUNT = 7


class Told:
    """An account whose parts lie on a table, and a clock that stands where it is told."""

    def __init__(self):
        self.now_ns, self.parts = 0, []
        self.account = Account(ACCOUNT, put=self.parts.append, now_ns=lambda: self.now_ns)

    def tell(self, n=1, payload=b"x"):
        for _ in range(n):
            self.account.tell("event", payload, log_ns=self.now_ns, stamp_ns=self.now_ns)

    def hear(self, number, *, is_open=True, account=ACCOUNT):
        self.account.take(AccountWritten(account=account, number=number, is_open=is_open))

    def take(self):
        taken = list(self.parts)
        self.parts.clear()
        return taken


def part(number, *, oldest=0, account=ACCOUNT):
    return AccountPart(
        account=account, number=number, oldest=oldest, topic="event", log_ns=number, stamp_ns=number, payload=b"x"
    )


def numbers(parts):
    return [found.number for found in parts]


@pytest.mark.parametrize("seed", range(20))
def test_over_a_link_that_loses_doubles_and_reorders_each_part_is_handed_on_once_and_in_order(seed):
    rng = np.random.default_rng(seed)
    told, order, on_the_way, got = Told(), AccountOrder(), [], []
    for step in range(400):
        told.now_ns += 50_000_000
        if step < 200:
            told.tell(int(rng.integers(1, 4)))
        else:
            told.account.tell_again()
        for each in told.take():
            on_the_way += [each] * int(rng.choice([0, 1, 1, 1, 2]))
        rng.shuffle(on_the_way)
        n_now = int(rng.integers(0, len(on_the_way) + 1))
        for each in on_the_way[:n_now]:
            got += numbers(order.take(each))
        del on_the_way[:n_now]
        if step % 10 == 9 and order.account and rng.random() < 0.8:
            told.hear(order.number)
    assert got == list(range(len(got)))
    assert len(got) > 200
    assert (told.account.n_waiting, order.n_missed) == (0, 0)


def test_what_nobody_wrote_is_told_again_after_a_while_and_not_before():
    told = Told()
    told.tell(3)
    told.take()
    told.now_ns = AGAIN_NS - 1
    told.hear(-1)
    told.account.tell_again()
    assert not told.parts
    told.now_ns = AGAIN_NS
    told.account.tell_again()
    assert numbers(told.take()) == [0, 1, 2]


def test_nothing_is_told_again_where_nobody_writes():
    told = Told()
    told.tell(3)
    told.take()
    told.hear(0)
    told.now_ns = DEAF_NS
    told.account.tell_again()
    assert not told.parts
    told.hear(0)
    told.account.tell_again()
    assert numbers(told.take()) == [1, 2]


def test_what_is_written_is_kept_no_more():
    told = Told()
    told.tell(5)
    told.hear(2)
    assert told.account.n_waiting == 2
    told.hear(4, account=ACCOUNT + 1)
    assert told.account.n_waiting == 2
    told.hear(4)
    assert told.account.n_waiting == 0


def test_a_recorder_that_was_started_anew_is_told_from_the_oldest_that_nobody_wrote():
    told = Told()
    told.tell(5)
    told.hear(2)
    told.take()
    told.tell()
    order = AccountOrder()
    assert numbers(order.take(told.take()[0])) == []
    told.hear(order.number)
    told.now_ns = AGAIN_NS
    told.account.tell_again()
    assert numbers(p for each in told.take() for p in order.take(each)) == [3, 4, 5]


def test_an_account_that_nobody_writes_keeps_no_more_than_its_room_and_the_gap_is_counted():
    told, order = Told(), AccountOrder()
    told.tell(1, bytes(MOST_BYTES))
    assert told.account.n_waiting == 1
    told.tell(1)
    assert told.account.n_waiting == 1
    assert numbers(order.take(part(0))) == [0]
    told.tell(1)
    assert numbers(p for each in told.take()[1:] for p in order.take(each)) == [1, 2]
    assert numbers(order.take(part(9, oldest=9))) == [9]
    assert order.n_missed == 6


def test_a_part_that_is_missing_for_good_is_given_up_after_so_many_that_wait_for_it():
    order = AccountOrder()
    assert numbers(order.take(part(0))) == [0]
    for number in range(2, MOST_AHEAD + 2):
        assert numbers(order.take(part(number))) == []
    assert numbers(order.take(part(MOST_AHEAD + 2))) == list(range(2, MOST_AHEAD + 3))
    assert order.n_missed == 1


def test_what_came_of_a_stretch_that_is_given_up_is_handed_on():
    order = AccountOrder()
    assert numbers(order.take(part(0))) == [0]
    assert numbers(order.take(part(3))) == []
    assert numbers(order.take(part(6, oldest=5))) == [3]
    assert numbers(order.take(part(5, oldest=5))) == [5, 6]
    assert order.n_missed == 3


def test_another_account_begins_anew():
    order = AccountOrder()
    assert numbers(order.take(part(0))) == [0]
    assert numbers(order.take(part(0, account=8))) == [0]
    assert order.account == 8


def test_an_opening_is_wanted_as_long_as_somebody_writes_who_has_heard_none():
    told = Told()
    assert not told.account.wants_opening
    told.hear(-1, is_open=False)
    assert told.account.wants_opening
    told.hear(0, is_open=True)
    assert not told.account.wants_opening
    told.hear(0, is_open=False)
    told.now_ns = DEAF_NS
    assert not told.account.wants_opening


def test_an_opening_that_is_on_its_way_is_not_wanted_again():
    told = Told()
    told.tell(3)
    told.account.begin()
    told.tell()
    told.hear(2, is_open=False)
    assert not told.account.wants_opening
    told.hear(3, is_open=False)
    assert told.account.wants_opening
