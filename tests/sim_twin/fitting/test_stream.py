import msgspec
import numpy as np

from config.loader import load_arm
from robot.messages import ArmMode
from sim_twin.fitting.stream import TickRow, pieces_of, rows_of
from tests.support.fit_streams import RAISED_RAD, ticks_of_twin, waves

ARM = load_arm("ur5e")
TICK_S = 0.01
ROWS = ticks_of_twin(ARM, waves(np.add(ARM.home_rad, RAISED_RAD), n=400, tick_s=TICK_S), tick_s=TICK_S)


def changed(rows, k, **fields):
    state = msgspec.structs.replace(rows[k].state, **fields)
    return [*rows[:k], TickRow(state=state, command=rows[k].command), *rows[k + 1 :]]


def lengths(rows):
    return [piece.n for piece in pieces_of(rows, tick_s=TICK_S)]


def test_a_run_is_cut_into_pieces_of_some_seconds_with_what_was_asked_before():
    first = pieces_of(ROWS[:300], tick_s=TICK_S)
    assert [piece.n for piece in first] == [300]
    assert len(first[0].lead_rad) == 0
    long = [*ROWS, *ROWS_LATER]
    pieces = pieces_of(long, tick_s=TICK_S)
    assert sum(piece.n for piece in pieces) == len(long)
    assert [len(piece.lead_rad) for piece in pieces] == [0, 50, 50]
    assert (pieces[1].lead_rad[-1] == pieces[0].asked_rad[-1]).all()


ROWS_LATER = [
    TickRow(state=msgspec.structs.replace(row.state, stamp_ns=row.state.stamp_ns + 4_000_000_000), command=row.command)
    for row in ROWS
]


def test_a_gap_cuts_and_ticks_that_nobody_read_do_not():
    assert lengths([*ROWS[:150], *ROWS[170:]]) == [150, 230]
    (piece,) = pieces_of([*ROWS[:150], *ROWS[153:]], tick_s=TICK_S)
    assert piece.n == 400
    assert np.flatnonzero(~piece.seen).tolist() == [150, 151, 152]
    assert (piece.asked_rad[150:153] == piece.asked_rad[149]).all()
    assert piece.q_rad[153].tolist() == list(ROWS[153].state.q_rad)


def test_a_touch_and_a_thing_in_the_hand_are_left_out():
    assert lengths(changed(ROWS, 200, tcp_force_n=(0.0, 0.0, 20.0))) == [200, 199]
    held = msgspec.structs.replace(ROWS[0].state.grip, has_object=True)
    assert lengths(changed(ROWS, 200, grip=held)) == [200, 199]


def test_an_arm_that_does_not_run_is_left_out():
    assert lengths(changed(ROWS, 200, mode=ArmMode.PROTECTIVE_STOP)) == [200, 199]


def test_what_is_too_short_to_tell_anything_is_left_out():
    assert lengths(ROWS[:70]) == []


def test_a_reset_breaks_a_run_and_a_command_belongs_to_the_measurement_before_it():
    a, b = ROWS[0], ROWS[1]
    runs = rows_of([a.state, a.command, b.state, None, b.command, b.state, b.command])
    assert [[row.state for row in run] for run in runs] == [[a.state], [b.state]]
