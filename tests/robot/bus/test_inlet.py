"""What a reader makes of what comes: messages, or counts. Nothing that comes raises."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.bus.envelope import HEAD_BYTES
from robot.bus.errors import MalformedError, SchemaError
from robot.bus.inlet import MAX_STREAMS, Counts, Inlet
from robot.bus.outlet import Outlet
from robot.bus.topic import Keep, Role, Topic

CLOCK, DEADLINE_S, MS = 7, 0.1, 1_000_000


class Level(msgspec.Struct, frozen=True, kw_only=True):
    height_m: float


class OtherLevel(msgspec.Struct, frozen=True, kw_only=True):
    height_mm: float


NEWEST = Topic(name="tank/level", kind=Level, writers=(Role.TWIN,), deadline_s=DEADLINE_S)
ALL = msgspec.structs.replace(NEWEST, keep=Keep.ALL)


class Time:
    ns = 1_000_000_000

    def __call__(self):
        return self.ns


def outlet(kind=Level, *, source="twin", clock=CLOCK, time=None):
    return Outlet(kind, source=source, clock=clock, now_ns=time or Time())


def inlet(topic=NEWEST):
    return Inlet(topic, reader="reader", clock=CLOCK)


def feed(reader, wrapped, now_ns=Time.ns):
    return reader.take(wrapped.attachment, wrapped.payload, now_ns)


def level(height_m=1.0):
    return Level(height_m=height_m)


def test_a_message_comes_with_its_envelope_and_age():
    reader, writer = inlet(), outlet()
    received = feed(reader, writer.wrap(level(2.0), stamp_ns=Time.ns - 5), Time.ns)
    assert received.message == level(2.0)
    assert (received.age_ns, received.stamp_ns) == (5, Time.ns - 5)
    assert (received.envelope.source, received.envelope.sequence) == ("twin", 0)
    assert reader.counts == Counts(received=1, taken=1)
    assert reader.error is None


@pytest.mark.parametrize(("age_ns", "n_late"), [(0, 0), (100 * MS, 0), (100 * MS + 1, 1)])
def test_a_message_is_late_from_its_deadline_on_and_handed_on_all_the_same(age_ns, n_late):
    reader = inlet()
    assert feed(reader, outlet().wrap(level(), stamp_ns=Time.ns), Time.ns + age_ns).age_ns == age_ns
    assert reader.counts.late == n_late


def test_no_age_is_judged_across_two_clocks():
    reader = inlet()
    received = feed(reader, outlet(clock=CLOCK + 1).wrap(level(), stamp_ns=0), Time.ns)
    assert received.age_ns is None
    assert received.stamp_ns == Time.ns
    assert reader.counts.late == 0


def test_another_schema_is_an_error_that_names_both_sides_and_costs_no_sequence():
    reader = inlet()
    assert feed(reader, outlet(OtherLevel, source="old_twin").wrap(OtherLevel(height_mm=1.0))) is None
    assert reader.counts == Counts(received=1, other_schema=1)
    assert isinstance(reader.error, SchemaError)
    for words in ("tank/level", "Level", "reader", "old_twin"):
        assert words in str(reader.error)
    assert feed(reader, outlet().wrap(level())) is not None
    assert reader.error is None


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=80), st.binary(max_size=40))
def test_rubbish_is_counted_and_told(attachment, payload):
    reader = inlet()
    assert reader.take(attachment, payload, 0) is None
    assert reader.counts == Counts(received=1, malformed=1)
    assert isinstance(reader.error, MalformedError)
    assert "tank/level" in str(reader.error)


@pytest.mark.parametrize("payload", [b"", b"null", b"[]", b'{"height_m":"NaN"}', b'{"height_m":null}', b"\xff"])
def test_a_good_envelope_around_rubbish_is_malformed_and_its_number_is_not_missed(payload):
    reader, writer = inlet(), outlet()
    feed(reader, writer.wrap(level()))
    assert reader.take(writer.wrap(level()).attachment, payload, Time.ns) is None
    assert feed(reader, writer.wrap(level())) is not None
    assert reader.counts == Counts(received=3, taken=2, malformed=1)


def test_an_envelope_with_a_good_head_and_an_odd_tail_takes_nobody_s_place():
    reader, time = inlet(), Time()
    writer = outlet(time=time)
    feed(reader, writer.wrap(level()))
    time.ns += 1
    odd = bytearray(outlet(time=time).wrap(level()).attachment)
    odd[HEAD_BYTES] = 0x80
    assert reader.take(bytes(odd), b"", Time.ns) is None
    assert feed(reader, writer.wrap(level())) is not None
    assert reader.counts == Counts(received=3, taken=2, malformed=1)


def shuffled(reader):
    writer = outlet()
    first, second, third, fourth = (writer.wrap(level(float(k))) for k in range(4))
    return [feed(reader, wrapped) for wrapped in (first, third, second, third, fourth)]


def test_of_what_was_overtaken_the_newest_alone_is_handed_on():
    reader = inlet()
    came = [received and received.message.height_m for received in shuffled(reader)]
    assert came == [0.0, 2.0, None, None, 3.0]
    assert reader.counts == Counts(received=5, taken=3, reordered=1, duplicated=1)


def test_a_topic_that_keeps_all_is_handed_what_was_overtaken_and_nothing_twice():
    reader = inlet(ALL)
    came = [received and received.message.height_m for received in shuffled(reader)]
    assert came == [0.0, 2.0, 1.0, None, 3.0]
    assert reader.counts == Counts(received=5, taken=4, reordered=1, duplicated=1)


def test_what_is_missing_is_lost_until_it_comes():
    reader, writer = inlet(), outlet()
    first, second, third = (writer.wrap(level()) for _ in range(3))
    feed(reader, first)
    feed(reader, third)
    assert reader.counts.lost == 1
    feed(reader, second)
    assert reader.counts.lost == 0


@pytest.mark.parametrize(("topic", "is_taken"), [(NEWEST, False), (ALL, True)])
def test_a_source_that_begins_anew_is_followed_and_what_its_former_self_still_sends_is_old(topic, is_taken):
    reader, time = inlet(topic), Time()
    former = outlet(time=time)
    feed(reader, former.wrap(level()))
    time.ns += 1
    latter = outlet(time=time)
    assert feed(reader, latter.wrap(level())) is not None
    assert (feed(reader, former.wrap(level())) is not None) is is_taken
    counts = reader.counts
    assert (counts.restarts, counts.lost, counts.duplicated, counts.reordered) == (1, 0, 0, 1)


def test_two_sources_of_one_topic_are_numbered_each_for_itself():
    reader = inlet()
    writers = [outlet(source=name) for name in ("one", "two")]
    for _ in range(5):
        assert all(feed(reader, writer.wrap(level())) is not None for writer in writers)
    assert reader.counts == Counts(received=10, taken=10)


def test_a_flood_of_sources_takes_no_memory_and_its_losses_stay_counted():
    reader = inlet()
    for k in range(3 * MAX_STREAMS):
        writer = outlet(source=f"s{k}")
        feed(reader, writer.wrap(level()))
        writer.wrap(level())
        feed(reader, writer.wrap(level()))
    assert len(reader._streams) == len(reader._current) == MAX_STREAMS
    assert reader.counts.lost == 3 * MAX_STREAMS
