"""A code that the cell shows: good once, in its time, for what it was shown for."""

import msgspec
import pytest

from config.rig import PlantExpected
from robot.errors import SafetyError
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.safety import Answer, AnsweredBy, Arming, Challenges, Grant, draw_code
from tests.support.words import HostTime

LIFE_NS = 10_000_000_000
REAL = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="20225500001")
GRANT = Grant(source="teleop", profile="attended", lease=3)


@pytest.fixture
def host():
    return HostTime(now_ns=7_000_000_000)


@pytest.fixture
def challenges(host):
    codes = iter(["0417", "9920", "3355"])
    return Challenges(now_ns=host, draw=lambda: next(codes))


@pytest.fixture
def arming(challenges):
    return Arming(
        expected=PlantExpected(kind="real", model="ur5e", serial=REAL.serial), max_latches=9, latch_window=10,
        challenges=challenges,
    )  # fmt: skip


def typed(text):
    return Answer(text, by=AnsweredBy.CONSOLE)


@pytest.mark.parametrize(
    ("after_ns", "is_taken"), [(0, True), (LIFE_NS, True), (LIFE_NS + 1, False), (-1, False), (2 * LIFE_NS, False)]
)
def test_the_answer_is_good_at_the_last_nanosecond_of_ten_seconds_and_not_at_the_next(
    challenges, host, after_ns, is_taken
):
    code = challenges.ask("this")
    host.now_ns += after_ns
    if is_taken:
        challenges.redeem(typed(f" {code}\n"), "this")
    else:
        with pytest.raises(SafetyError, match="within 10 s"):
            challenges.redeem(typed(code), "this")


def test_an_answer_is_taken_once(challenges):
    answer = typed(challenges.ask("this"))
    challenges.redeem(answer, "this")
    with pytest.raises(SafetyError, match="answered already"):
        challenges.redeem(answer, "this")


@pytest.mark.parametrize("wrong", ["0418", "", "04170", "O417", "\uff10417"])
def test_a_wrong_answer_uses_the_code_up(challenges, wrong):
    challenges.ask("this")
    with pytest.raises(SafetyError, match="came another"):
        challenges.redeem(typed(wrong), "this")
    with pytest.raises(SafetyError, match="nothing was asked"):
        challenges.redeem(typed("0417"), "this")


def test_no_answer_is_a_wrong_one(challenges):
    challenges.ask("this")
    with pytest.raises(SafetyError, match="came another"):
        challenges.redeem(None, "this")


def test_a_new_question_ends_the_one_before(challenges):
    challenges.ask("this")
    challenges.ask("this")
    with pytest.raises(SafetyError, match="came another"):
        challenges.redeem(typed("0417"), "this")


def test_an_answer_is_worth_nothing_for_something_else(challenges):
    code = challenges.ask("disarmed, teleop")
    with pytest.raises(SafetyError, match="shown for disarmed, teleop, now it would be for latched"):
        challenges.redeem(typed(code), "latched, teleop")


def test_codes_are_four_digits_and_not_always_the_same():
    codes = {draw_code() for _ in range(50)}
    assert all(len(code) == 4 and code.isdigit() for code in codes)
    assert len(codes) > 10


@pytest.mark.parametrize("encode", [msgspec.msgpack.encode, msgspec.json.encode, msgspec.to_builtins])
def test_no_bus_can_carry_an_answer(encode):
    with pytest.raises(TypeError):
        encode(typed("0417"))


def test_an_answer_does_not_print_its_code():
    assert "0417" not in repr(typed("0417"))


def test_a_real_arm_is_armed_by_an_answer_and_by_nothing_less(arming):
    for answer in (None, typed("0417")):
        with pytest.raises(SafetyError, match="nothing was asked"):
            arming.arm(identity=REAL, by="somebody", grant=GRANT, answer=answer)
    code = arming.challenge(GRANT)
    arming.arm(identity=REAL, by="somebody", grant=GRANT, answer=typed(code))
    assert arming.state.mode is StationMode.ARMED
    assert (arming.state.source, arming.state.profile) == ("teleop", "attended")


def test_a_latch_of_a_real_arm_is_cleared_by_another_answer_than_armed_it(arming):
    answer = typed(arming.challenge(GRANT))
    arming.arm(identity=REAL, by="somebody", grant=GRANT, answer=answer)
    arming.engage()
    arming.latch("force")
    arming.note_plant_reset()
    with pytest.raises(SafetyError):
        arming.clear_latch(identity=REAL, by="somebody", grant=GRANT, answer=answer)
    assert arming.state.reason == "force"
    arming.clear_latch(identity=REAL, by="somebody", grant=GRANT, answer=typed(arming.challenge(GRANT)))
    assert arming.state.mode is StationMode.ARMED


def test_a_code_shown_for_one_source_does_not_arm_for_another(arming):
    code = arming.challenge(GRANT)
    other = msgspec.structs.replace(GRANT, source="learner", lease=4)
    with pytest.raises(SafetyError, match="was shown for"):
        arming.arm(identity=REAL, by="somebody", grant=other, answer=typed(code))
    assert arming.state.mode is StationMode.DISARMED


def test_nothing_is_asked_where_there_is_nothing_to_arm(arming):
    arming.arm(identity=REAL, by="somebody", grant=GRANT, answer=typed(arming.challenge(GRANT)))
    with pytest.raises(SafetyError, match="disarmed or latched, it is armed"):
        arming.challenge(GRANT)


def test_a_station_that_cannot_ask_does_not_arm_a_real_arm():
    mute = Arming(expected=PlantExpected(kind="real", model="ur5e", serial=REAL.serial), max_latches=9, latch_window=10)
    with pytest.raises(SafetyError, match="cannot ask"):
        mute.arm(identity=REAL, by="somebody", answer=typed("0417"))
    with pytest.raises(SafetyError, match="cannot"):
        mute.challenge(GRANT)
