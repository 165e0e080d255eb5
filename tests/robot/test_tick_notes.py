"""Ticks are thinned for the bus, and no refusal of a command is."""

from robot.messages import Outcome, Verdict
from robot.tick_notes import MOST_NOTES, NOTE_HZ, TickNotes
from tests.support.stations import command

Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
REFUSED = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="speed")


def test_each_so_many_th_tick_is_noted_with_its_verdict():
    notes = TickNotes(rate_hz=500.0)
    for k in range(40):
        notes.commanded(command(Q, sequence=k), ("leash",) if k == 19 else (), None)
    every = round(500.0 / NOTE_HZ)
    taken = notes.take()
    assert [note.requested.sequence for note in taken] == [every - 1, 2 * every - 1, 3 * every - 1, 4 * every - 1]
    assert [note.verdict.outcome for note in taken] == [Outcome.PASSED, Outcome.LIMITED, *[Outcome.PASSED] * 2]
    assert all(note.is_sent for note in taken)
    assert notes.take() == ()


def test_every_refused_command_is_noted():
    notes = TickNotes(rate_hz=500.0)
    for k in range(3):
        notes.commanded(command(Q, sequence=k), (), REFUSED)
    taken = notes.take()
    assert [note.requested.sequence for note in taken] == [0, 1, 2]
    assert not any(note.is_sent for note in taken)


def test_where_nobody_asks_the_newest_are_kept():
    notes = TickNotes(rate_hz=NOTE_HZ)
    for k in range(MOST_NOTES + 1):
        notes.commanded(command(Q, sequence=k), (), None)
    taken = notes.take()
    assert (len(taken), taken[0].requested.sequence) == (MOST_NOTES, 1)
