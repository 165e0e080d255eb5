"""Ticks in shared memory: whole or none, each once, in their order, and a late reader knows what it missed."""

import math
from multiprocessing import get_context

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.messages import Outcome, Verdict
from robot.tick_ring import (
    FIRST_AT,
    MOST_BYTES,
    SLOT_BYTES,
    TickReader,
    TickWriter,
    decode_tick,
    ring_bytes,
    ticks_of,
)
from tests.support.stations import arm_state, command

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
N_SLOTS = 8
LATCHED = Verdict(stamp_ns=7, sequence=3, outcome=Outcome.REFUSED, reason="speed", detail="fast", is_latched=True)


def ring():
    memory = bytearray(ring_bytes(float(N_SLOTS), seconds=1.0))
    return memory, TickWriter(memory, now_ns=lambda: 5), TickReader(memory)


def write(writer, n, *, first=0):
    for k in range(first, first + n):
        writer.measured(arm_state(Q, stamp_ns=k))
        writer.commanded(command(Q, sequence=k), (), None)


def numbers(reader, most=None):
    return [decode_tick(raw).command.sequence for raw in reader.take(most)]


def test_a_tick_comes_back_as_it_was():
    _, writer, reader = ring()
    state, asked = arm_state(Q, stamp_ns=4), command(Q, sequence=9)
    writer.measured(state)
    writer.commanded(asked, ("leash", "guard"), None)
    writer.refused(LATCHED)
    first, second = map(decode_tick, reader.take())
    assert (first.state, first.command, first.limiters, first.verdict) == (state, asked, ("leash", "guard"), None)
    assert (first.measured_ns, first.at_ns) == (5, 5)
    assert (second.state, second.command, second.verdict) == (None, None, LATCHED), "a measurement is written once"


@pytest.mark.parametrize(("n", "n_missed"), [(0, 0), (N_SLOTS - 1, 0), (N_SLOTS, 0), (N_SLOTS + 1, 1), (100, 92)])
def test_a_late_reader_misses_the_oldest_and_knows_how_many(n, n_missed):
    _, writer, reader = ring()
    write(writer, n)
    assert reader.n_waiting == n
    assert numbers(reader) == list(range(n_missed, n))
    assert (reader.n_missed, reader.n_waiting) == (n_missed, 0)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, N_SLOTS), st.integers(1, N_SLOTS)), max_size=12))
def test_whatever_the_turns_every_tick_that_was_not_overwritten_is_read_once_and_in_order(turns):
    _, writer, reader = ring()
    seen, n = [], 0
    for n_written, most in turns:
        write(writer, n_written, first=n)
        n += n_written
        seen += numbers(reader, most)
    seen += numbers(reader)
    assert seen == sorted(set(seen))
    assert len(seen) + reader.n_missed == n


@settings(max_examples=40, deadline=None)
@given(at=st.integers(0, SLOT_BYTES - 1), bit=st.integers(0, 7))
def test_a_slot_with_one_wrong_bit_is_none_or_as_it_was(at, bit):
    memory, writer, reader = ring()
    write(writer, 1)
    (whole,) = reader.take()
    memory[FIRST_AT + SLOT_BYTES + at] ^= 1 << bit
    again = TickReader(memory)
    again._n = 0
    assert again.take() in ([], [whole])


def test_a_writer_that_takes_over_goes_on_where_the_one_before_was_killed():
    memory, writer, reader = ring()
    write(writer, 3)
    write(TickWriter(memory), 2, first=3)
    assert numbers(reader) == [0, 1, 2, 3, 4]


def write_elsewhere(memory, n):
    write(TickWriter(memory), n)


@pytest.mark.slow
def test_a_reader_in_another_process_sees_no_tick_twice_however_fast_they_come():
    context = get_context("spawn")
    memory = context.RawArray("B", ring_bytes(500.0, seconds=1.0))
    reader = TickReader(memory)
    process = context.Process(target=write_elsewhere, args=(memory, 20_000))
    process.start()
    seen = []
    while process.is_alive():
        seen += numbers(reader)
    seen += numbers(reader)
    process.join()
    assert process.exitcode == 0
    assert seen == sorted(set(seen))
    assert len(seen) + reader.n_missed == 20_000


def test_a_reader_begins_with_what_is_written_from_now_on():
    memory, writer, _ = ring()
    write(writer, 3)
    late = TickReader(memory)
    write(writer, 1, first=3)
    assert numbers(late) == [3]


@pytest.mark.parametrize("n_words", [1, MOST_BYTES, 10 * MOST_BYTES])
def test_a_refusal_of_any_length_has_room_and_keeps_its_reason(n_words):
    _, writer, reader = ring()
    writer.measured(arm_state(Q, stamp_ns=1))
    refused = msgspec.structs.replace(LATCHED, detail="x" * n_words)
    writer.commanded(command((math.nan,) * 6, sequence=2), (), refused)
    (tick,) = map(decode_tick, reader.take())
    assert (tick.verdict.reason, tick.verdict.is_latched) == ("speed", True)
    assert refused.detail.startswith(tick.verdict.detail)
    assert math.isnan(tick.command.q_rad[0])


def test_only_a_station_whose_arm_a_process_of_its_own_holds_has_ticks_to_read():
    class Holds:
        ticks = ring()[2]

    class Station:
        loop = Holds()

    assert ticks_of(Station()) is Holds.ticks
    assert ticks_of(object()) is None
