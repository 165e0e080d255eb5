"""What arming, leases, codes and limits say when they refuse, whole; and what they are before anybody did anything."""

import pytest
from msgspec.structs import replace

from config.loader import load_arm
from config.rig import PlantExpected
from robot.errors import NotEngagedError, SafetyError
from robot.hal.fake import FakeArm
from robot.messages import PlantIdentity, PlantKind, StationMode, StationState
from robot.safety import Answer, AnsweredBy, Arming, Challenges, Grant, TooManyLatchesError, draw_code
from tests.support.words import HostTime, says

ARM = load_arm("ur5e")
SPEC = FakeArm(arm=ARM, tick_s=0.01).spec
FAKE = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")
REAL = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="7")
GRANT = Grant(source="teleop", profile="attended", lease=3)
LIFE_NS = 1_000_000_000


def arming(kind="fake", *, most=1, window=10, challenges=None):
    serial = "7" if kind == "real" else "fake"
    expected = PlantExpected(kind=kind, model="ur5e", serial=serial)
    return Arming(expected=expected, max_latches=most, latch_window=window, challenges=challenges)


def in_mode(mode, **kwargs):
    made = arming(**kwargs)
    if mode is not StationMode.DISARMED:
        made.arm(identity=FAKE, by="tester")
    if mode in (StationMode.ENGAGED, StationMode.LATCHED):
        made.engage()
    if mode is StationMode.LATCHED:
        made.latch("a wall")
    return made


def asking(*codes):
    drawn = iter(codes)
    return Challenges(now_ns=HostTime(), draw=lambda: next(drawn))


def typed(text):
    return Answer(text, by=AnsweredBy.CONSOLE)


WHILE = {
    StationMode.DISARMED: "while it is disarmed",
    StationMode.ARMED: "while it is armed",
    StationMode.ENGAGED: "while it is engaged",
    StationMode.LATCHED: "while it is latched (a wall)",
}
ASKS = [
    (StationMode.DISARMED, lambda a: a.engage(), "engage"),
    (StationMode.DISARMED, lambda a: a.require_armed(), "engage"),
    (StationMode.DISARMED, lambda a: a.clear_latch(identity=FAKE, by="tester"), "clear latch"),
    (StationMode.ENGAGED, lambda a: a.arm(identity=FAKE, by="tester"), "arm"),
    (StationMode.ENGAGED, lambda a: a.require_armed(), "engage"),
    (StationMode.LATCHED, lambda a: a.arm(identity=FAKE, by="tester"), "arm"),
    (StationMode.LATCHED, lambda a: a.require_armed(), "engage"),
]


@pytest.mark.parametrize(("mode", "ask", "word"), ASKS)
def test_what_the_table_refuses_is_told_with_the_event_the_mode_and_why(mode, ask, word):
    with pytest.raises(SafetyError, match=says(f"to {word} a station is refused {WHILE[mode]}")):
        ask(in_mode(mode))


@pytest.mark.parametrize(
    ("mode", "is_it"),
    [
        (StationMode.DISARMED, "disarmed"),
        (StationMode.ARMED, "armed"),
        (StationMode.LATCHED, "latched (a wall)"),
    ],
)
def test_motion_without_an_engaged_station_is_refused_in_words(mode, is_it):
    with pytest.raises(
        NotEngagedError, match=says(f"expected an engaged station, it is {is_it}; an operator must arm it")
    ):
        in_mode(mode).require_engaged()


def test_a_new_station_is_disarmed_for_nobody_and_has_not_latched():
    made = arming()
    assert made.state == StationState(mode=StationMode.DISARMED, reason="", source="", profile="")
    assert not made.is_engaged
    assert made.n_latches == 0


def test_who_says_nothing_arms_for_this_process_and_no_profile():
    made = in_mode(StationMode.ENGAGED)
    assert made.state == StationState(mode=StationMode.ENGAGED, reason="", source="local", profile="")
    made.hold_to(Grant(source="local", profile="", lease=0))
    assert made.is_engaged


def test_a_stop_and_a_disarming_keep_their_reason_and_arming_forgets_it():
    made = in_mode(StationMode.ARMED)
    made.stop("a hand was seen")
    assert (made.state.mode, made.state.reason) == (StationMode.DISARMED, "a hand was seen")
    made.disarm("too late to say")
    assert made.state.reason == "a hand was seen"
    made.arm(identity=FAKE, by="tester")
    assert made.state.reason == ""
    made.disarm()
    assert (made.state.mode, made.state.reason) == (StationMode.DISARMED, "")


def test_a_stop_of_what_is_engaged_latches_with_its_reason():
    made = in_mode(StationMode.ENGAGED)
    made.stop("a hand was seen")
    assert (made.state.mode, made.state.reason, made.n_latches) == (StationMode.LATCHED, "a hand was seen", 1)


@pytest.mark.parametrize("mode", [StationMode.ARMED, StationMode.ENGAGED])
@pytest.mark.parametrize(
    ("now", "ending"),
    [
        (None, "no lease is in force"),
        (replace(GRANT, source="learner"), "now there is learner under lease 3, profile attended"),
    ],
)
def test_whoever_finds_it_disarmed_reads_what_it_was_armed_for_and_what_there_is_now(mode, now, ending):
    made = arming()
    made.arm(identity=FAKE, by="tester", grant=GRANT)
    if mode is StationMode.ENGAGED:
        made.engage()
    made.hold_to(now)
    assert made.state.reason == f"it was armed for teleop under lease 3, profile attended; {ending}"


@pytest.mark.parametrize("mode", [StationMode.DISARMED, StationMode.LATCHED])
def test_what_is_not_armed_is_held_to_nothing(mode):
    made = in_mode(mode)
    before = made.state
    made.hold_to(GRANT)
    made.hold_to(None)
    assert made.state == before


def test_a_latch_is_not_cleared_before_the_plants_reset_and_says_so():
    made = in_mode(StationMode.LATCHED)
    with pytest.raises(SafetyError, match=says("latched (a wall): reset the plant before clearing the latch")):
        made.clear_latch(identity=FAKE, by="tester")


def test_clearing_a_latch_forgets_its_reason_and_names_whom_it_is_armed_for_now():
    made = in_mode(StationMode.LATCHED)
    made.note_plant_reset()
    made.clear_latch(identity=FAKE, by="tester", grant=GRANT)
    assert made.state == StationState(mode=StationMode.ARMED, reason="", source="teleop", profile="attended")


def test_a_latch_after_another_was_cleared_needs_a_reset_of_its_own():
    made = in_mode(StationMode.LATCHED, most=5)
    made.note_plant_reset()
    made.clear_latch(identity=FAKE, by="tester")
    made.latch("again")
    with pytest.raises(SafetyError, match=r"^latched \(again\): reset the plant"):
        made.clear_latch(identity=FAKE, by="tester")


@pytest.mark.parametrize(("n_resets", "is_too_many"), [(9, True), (10, False)])
def test_a_latch_counts_until_as_many_resets_as_the_window_has(n_resets, is_too_many):
    made = in_mode(StationMode.LATCHED, most=1, window=10)
    made.note_plant_reset()
    made.clear_latch(identity=FAKE, by="tester")
    for _ in range(n_resets - 2):
        made.note_plant_reset()
    made.latch("a second wall")
    made.note_plant_reset()
    if is_too_many:
        message = "expected at most 1 latches in 10 resets, came 2; last: a second wall"
        with pytest.raises(TooManyLatchesError, match=says(message)):
            made.clear_latch(identity=FAKE, by="tester")
    else:
        made.clear_latch(identity=FAKE, by="tester")


def test_too_many_latches_are_told_before_the_missing_reset():
    made = in_mode(StationMode.LATCHED, most=0)
    with pytest.raises(TooManyLatchesError, match="at most 0 latches in 10 resets, came 1"):
        made.clear_latch(identity=FAKE, by="tester")


def test_who_answers_is_asked_after_which_plant_it_is():
    made = arming()
    found = "the rig names plant fake/ur5e/fake, found real/ur5e/7: check the rig's file"
    with pytest.raises(SafetyError, match=says(found)):
        made.arm(identity=REAL, by="")
    with pytest.raises(SafetyError, match=says("somebody must answer for arming a fake plant: name who")):
        made.arm(identity=FAKE, by="")


def test_a_station_that_cannot_ask_says_so():
    made = arming("real")
    message = "a real arm is armed by an answer to what its cell shows; this station cannot ask"
    with pytest.raises(SafetyError, match=says(message)):
        made.arm(identity=REAL, by="tester")
    message = "expected a station that can ask whoever is at its cell, this one cannot"
    with pytest.raises(SafetyError, match=says(message)):
        made.challenge(GRANT)


@pytest.mark.parametrize("mode", [StationMode.ARMED, StationMode.ENGAGED])
def test_nothing_is_asked_while_there_is_nothing_to_arm(mode):
    made = in_mode(mode, challenges=asking("1"))
    message = f"to ask for arming the station must be disarmed or latched, it is {mode}"
    with pytest.raises(SafetyError, match=says(message)):
        made.challenge(GRANT)


def test_a_plant_that_is_not_real_needs_no_answer_but_one_that_is_given_is_taken():
    made = arming(challenges=asking("1234"))
    made.arm(identity=FAKE, by="tester")
    made.disarm()
    with pytest.raises(SafetyError, match="nothing was asked"):
        made.arm(identity=FAKE, by="tester", answer=typed("1234"))
    code = made.challenge(GRANT)
    made.arm(identity=FAKE, by="tester", grant=GRANT, answer=typed(code))
    assert made.state.mode is StationMode.ARMED


def test_a_code_shown_while_disarmed_does_not_clear_a_latch():
    made = arming("real", challenges=asking("1", "2"))
    code = made.challenge(GRANT)
    made.latch("a wall")
    made.note_plant_reset()
    message = (
        "the code was shown for disarmed, teleop under lease 3, profile attended, "
        "now it would be for latched, teleop under lease 3, profile attended: ask again"
    )
    with pytest.raises(SafetyError, match=says(message)):
        made.clear_latch(identity=REAL, by="tester", grant=GRANT, answer=typed(code))
    made.clear_latch(identity=REAL, by="tester", grant=GRANT, answer=typed(made.challenge(GRANT)))


def test_what_is_wrong_with_an_answer_is_told():
    host = HostTime()
    challenges = Challenges(now_ns=host, draw=lambda: "1234")
    message = "an answer to what the cell shows: nothing was asked, or it was answered already"
    with pytest.raises(SafetyError, match=says(message)):
        challenges.redeem(typed("1234"), "this")
    challenges.ask("this")
    message = "expected the code that the cell shows, came another: ask again, the code is used up"
    with pytest.raises(SafetyError, match=says(message)):
        challenges.redeem(typed("4321"), "this")
    challenges.ask("this")
    host.now_ns += 10_000_000_001
    message = "expected the answer within 10 s of the code, it came later: ask again"
    with pytest.raises(SafetyError, match=says(message)):
        challenges.redeem(typed("1234"), "this")


def test_an_answer_tells_how_it_came_and_takes_no_more_fields():
    answer = Answer("1234", by=AnsweredBy.WIRED)
    assert repr(answer) == "Answer(by='wired input')"
    assert answer.by is AnsweredBy.WIRED
    assert not hasattr(answer, "__dict__")


def test_a_code_is_filled_up_with_zeros(monkeypatch):
    asked = []
    monkeypatch.setattr("robot.safety.challenge.secrets.randbelow", lambda n: asked.append(n) or 7)
    assert draw_code() == "0007"
    assert asked == [10_000]
