"""The table itself: every row can be meant as it says."""

import re

import pytest

from robot.bus.codec import Codec
from robot.bus.errors import BusConfigError
from robot.bus.topic import NAME, Congestion, Priority, Role, key_of
from robot.bus.topics import HEALTH, QUERIES, STOP, TOPICS

ROWS = [*TOPICS, *QUERIES]


def test_no_two_rows_have_one_key():
    names = [row.name for row in ROWS]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(rf"{NAME}(/{NAME})*", name) for name in names)


@pytest.mark.parametrize("row", TOPICS, ids=lambda row: row.name)
def test_a_topic_has_a_writer_a_type_that_can_be_sent_and_a_deadline_longer_than_its_period(row):
    assert row.writers
    assert (Role.VIEWER in row.writers) is (row in (STOP, HEALTH)), "who looks may say stop and how he is, and no more"
    assert Codec(row.kind).schema
    assert (row.rate_hz is None) or row.rate_hz > 0
    assert row.deadline_s is None or row.rate_hz is None or row.deadline_s >= 2 / row.rate_hz


@pytest.mark.parametrize("row", QUERIES, ids=lambda row: row.name)
def test_a_query_has_somebody_who_asks_and_somebody_who_answers(row):
    assert row.asked_by
    assert row.answered_by
    assert row.answer_s > 0


def test_who_measures_or_moves_waits_for_nobody():
    for row in TOPICS:
        if row.priority in (Priority.REAL_TIME, Priority.DATA_HIGH):
            assert row.congestion is Congestion.DROP, row.name


@pytest.mark.parametrize("serial", ["", "a/b", "*", "a b", "**", "$*", "a?x", "a#"])
def test_a_serial_that_would_be_read_as_a_pattern_is_refused(serial):
    with pytest.raises(BusConfigError, match="serial"):
        key_of(serial, "twin/truth")


def test_a_key_is_below_its_plant_s_serial():
    assert key_of("2021", "twin/truth") == "autotelic/2021/twin/truth"
