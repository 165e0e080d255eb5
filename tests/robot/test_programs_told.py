"""Whose a program is that a controller tells of: ours by its name and by an upload, and nobody else's."""

import pytest

from robot.hal.programs_told import OURS, STARTED, STOPPED, ProgramsTold
from robot.hal.ur_primary import KeyMessage


def told(*lines, n_uploads=1):
    programs = ProgramsTold()
    for _ in range(n_uploads):
        programs.expect()
    for title, text in lines:
        programs.take(KeyMessage(title=title, text=text))
    return programs


@pytest.mark.parametrize(
    ("lines", "is_ours", "may_be_ours", "foreign"),
    [
        ((), False, True, None),
        (((STARTED, OURS),), True, True, None),
        (((STARTED, OURS), (STOPPED, OURS)), False, False, None),
        (((STARTED, "other"),), False, True, "other"),
        (((STARTED, "other"), (STOPPED, "other")), False, True, "other"),
        (((STARTED, "other"), (STOPPED, "other"), (STARTED, OURS)), True, True, "other"),
        (((STARTED, OURS), (STOPPED, OURS), (STARTED, "other")), False, False, "other"),
        (((STARTED, OURS), (STOPPED, "other")), True, True, None),
        (((STARTED, OURS), ("SAFETY_MODE", "other")), True, True, None),
        (((STARTED, OURS), (STARTED, OURS)), False, False, OURS),
    ],
)
def test_whose_a_program_is(lines, is_ours, may_be_ours, foreign):
    programs = told(*lines)
    assert (programs.is_ours, programs.may_be_ours, programs.foreign) == (is_ours, may_be_ours, foreign)


def test_what_is_called_as_ours_and_was_not_uploaded_by_us_is_somebodys():
    assert told((STARTED, OURS), n_uploads=0).foreign == OURS
