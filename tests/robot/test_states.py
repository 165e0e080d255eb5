"""The table of states in SAFETY.md, walked cell by cell on the arming itself."""

from pathlib import Path

import pytest

from config.rig import PlantExpected
from robot.errors import SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.safety import TABLE, Arming, Event, next_mode

IDENTITY = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")
ROWS = [
    [cell.strip() for cell in line.strip("|\n").split("|")]
    for line in (Path(__file__).parents[2] / "SAFETY.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("|")
]
HEAD = next(row for row in ROWS if row[0] == "in")
TOLD = {
    (StationMode(row[0]), Event(event.replace(" ", "_"))): row[i]
    for row in ROWS
    if row[0] in set(StationMode)
    for i, event in enumerate(HEAD)
    if i
}


def arming_in(mode):
    arming = Arming(expected=PlantExpected(kind="fake", model="ur5e", serial="fake"), max_latches=9, latch_window=10)
    if mode is not StationMode.DISARMED:
        arming.arm(identity=IDENTITY, by="tester")
    if mode in (StationMode.ENGAGED, StationMode.LATCHED):
        arming.engage()
    if mode is StationMode.LATCHED:
        arming.latch("the first reason")
        arming.note_plant_reset()
    assert arming.state.mode is mode
    return arming


DO = {
    Event.ARM: lambda a: a.arm(identity=IDENTITY, by="tester"),
    Event.ENGAGE: lambda a: a.engage(),
    Event.DISARM: lambda a: a.disarm("let go"),
    Event.STOP: lambda a: a.stop("stopped by a tester"),
    Event.LATCH: lambda a: a.latch("another reason"),
    Event.PLANT_RESET: lambda a: a.note_plant_reset(),
    Event.CLEAR_LATCH: lambda a: a.clear_latch(identity=IDENTITY, by="tester"),
}


def test_the_table_has_every_state_and_every_event():
    assert set(TOLD) == {(mode, event) for mode in StationMode for event in Event}
    assert set(TABLE) == set(StationMode)
    assert all(set(row) == set(Event) for row in TABLE.values())


@pytest.mark.parametrize(("mode", "event"), sorted(TOLD))
def test_an_event_does_what_the_table_in_safety_md_says(mode, event):
    told, arming = TOLD[mode, event], arming_in(mode)
    before = arming.state
    if told == "refused":
        with pytest.raises(SafetyError, match=f"while it is {mode}"):
            DO[event](arming)
        assert arming.state == before
        assert next_mode(mode, event) is None
    else:
        DO[event](arming)
        assert arming.state.mode is StationMode(told)
        assert next_mode(mode, event) is StationMode(told)
    assert (
        arming.state.mode is not StationMode.LATCHED
        or mode is not StationMode.LATCHED
        or (arming.state.reason == "the first reason")
    )


def test_nothing_but_arm_engage_and_a_cleared_latch_leads_nearer_to_motion():
    nearer = {
        (mode, event)
        for mode, row in TABLE.items()
        for event, after in row.items()
        if after in (StationMode.ARMED, StationMode.ENGAGED) and after is not mode
    }
    assert nearer == {
        (StationMode.DISARMED, Event.ARM),
        (StationMode.ARMED, Event.ENGAGE),
        (StationMode.LATCHED, Event.CLEAR_LATCH),
    }
