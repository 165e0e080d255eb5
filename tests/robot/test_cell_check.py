"""What a walk through a cell's wires concludes from what was seen."""

import pytest

from robot.cell_check import Seen, Wire, judge_input, judge_output

CLOSES = Wire(signal=0, name="green_button", what="button", pin="CI3")
OPENS = Wire(signal=0, name="green_button", what="button", pin="CI3", inverted=True)
HIGH, OTHER = 1 << 11, 1 << 2


@pytest.mark.parametrize(
    ("wire", "seen", "verdict"),
    [
        (CLOSES, (0, HIGH, 0), ""),
        (CLOSES, (OTHER, OTHER | HIGH, OTHER), ""),
        (OPENS, (HIGH, 0, HIGH), ""),
        (OPENS, (0, HIGH, 0), "the wrong way round: inverted must be false"),
        (CLOSES, (HIGH, 0, HIGH), "the wrong way round: inverted must be true"),
        (CLOSES, (0, 0, 0), "nothing seen: is it connected?"),
        (CLOSES, (0, OTHER, 0), "seen at DI2, expected CI3 alone"),
        (CLOSES, (0, OTHER | HIGH, 0), "seen at DI2, CI3, expected CI3 alone"),
        (CLOSES, (0, HIGH, HIGH), "does not go back"),
    ],
)
def test_an_input_is_judged_by_what_its_terminals_did(wire, seen, verdict):
    before, pressed, after = seen
    assert judge_input(wire, Seen(before=before, pressed=pressed, after=after)) == verdict


@pytest.mark.parametrize(
    ("saw_on", "saw_off", "begins"),
    [(True, True, ""), (False, True, "never seen on"), (True, False, "never seen off"), (False, False, "the wrong")],
)
def test_an_output_is_judged_by_what_was_seen(saw_on, saw_off, begins):
    assert judge_output(saw_on=saw_on, saw_off=saw_off)[: len(begins)] == begins
    assert bool(judge_output(saw_on=saw_on, saw_off=saw_off)) is bool(begins)
