"""What arming, leases, codes and limits say when they refuse, whole; and what they are before anybody did anything."""

import math
import re

import pytest
from msgspec.structs import replace

from config.loader import load_arm
from config.rig import PlantExpected
from robot.errors import NotEngagedError, RobotConfigError, SafetyError
from robot.hal.fake import FakeArm
from robot.messages import PlantIdentity, PlantKind, StationMode, StationState
from robot.safety import (
    Answer,
    AnsweredBy,
    Arming,
    Challenges,
    GateLimits,
    Grant,
    LeaseBook,
    Tenure,
    TooManyLatchesError,
    check_profile_fits,
    draw_code,
)
from tests.support.profiles import profile

ARM = load_arm("ur5e")
SPEC = FakeArm(arm=ARM, tick_s=0.01).spec
FAKE = PlantIdentity(kind=PlantKind.FAKE, model="ur5e", serial="fake")
REAL = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="7")
GRANT = Grant(source="teleop", profile="attended", lease=3)
LIFE_NS = 1_000_000_000


class Time:
    def __init__(self, now_ns=5_000_000_000):
        self.now_ns = now_ns

    def __call__(self):
        return self.now_ns


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
    return Challenges(now_ns=Time(), draw=lambda: next(drawn))


def typed(text):
    return Answer(text, by=AnsweredBy.CONSOLE)


def says(message):
    return f"^{re.escape(message)}$"


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
    host = Time()
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


def test_a_lease_says_who_has_it_and_what_became_of_it():
    host = Time()
    book = LeaseBook(now_ns=host)
    with pytest.raises(SafetyError, match=says("a lease: expected the name of its source, came none")):
        book.take("")
    lease = book.take("teleop", life_ns=LIFE_NS)
    assert (lease.number, lease.life_ns) == (1, LIFE_NS)
    message = "a lease for learner: teleop has it; it must be handed over or let go of first"
    with pytest.raises(SafetyError, match=says(message)):
        book.take("learner")
    message = "a hand-over: expected the name of the source that takes over, came none"
    with pytest.raises(SafetyError, match=says(message)):
        book.hand_over(lease, "")
    host.now_ns += LIFE_NS + 1
    message = "the lease 1 of teleop has expired: nothing was heard in its time"
    with pytest.raises(SafetyError, match=says(message)):
        book.renew(lease)
    book.revive(lease)
    other = book.hand_over(lease, "learner", life_ns=2 * LIFE_NS)
    assert (other.source, other.number, other.life_ns) == ("learner", 2, 2 * LIFE_NS)
    with pytest.raises(SafetyError, match=says("the lease 1 of teleop has ended; learner has it now")):
        book.revive(lease)
    book.release(other)
    with pytest.raises(SafetyError, match=says("the lease 2 of learner has ended; nobody has it now")):
        book.renew(other)


@pytest.mark.parametrize("how", ["renew", "revive", "hand over", "take"])
def test_a_lease_lives_anew_from_the_moment_it_was_renewed(how):
    host = Time()
    book = LeaseBook(now_ns=host)
    lease = book.take("a", life_ns=LIFE_NS)
    host.now_ns += LIFE_NS
    if how == "hand over":
        lease = book.hand_over(lease, "b", life_ns=LIFE_NS)
    elif how == "take":
        lease = book.take("a", life_ns=LIFE_NS)
    else:
        getattr(book, how)(lease)
    host.now_ns += LIFE_NS
    assert book.is_in_force(lease)
    host.now_ns += 1
    assert not book.is_in_force(lease)


def tenure(host, *, most=9):
    made = arming(most=most)
    return made, Tenure(arming=made, profile="attended", now_ns=host)


def test_a_station_nobody_took_is_the_own_process_s_for_good():
    host = Time()
    _, held = tenure(host)
    assert held.grant is None
    assert held.renewed() == Grant(source="local", profile="attended", lease=1)
    host.now_ns += 10**18
    assert held.grant == Grant(source="local", profile="attended", lease=1)


def test_a_tenure_tells_once_that_motion_was_taken_away():
    host = Time()
    made, held = tenure(host)
    assert held.holds()
    held.take("teleop", life_ns=LIFE_NS)
    made.arm(identity=FAKE, by="tester", grant=held.renewed())
    made.engage()
    assert held.holds()
    host.now_ns += LIFE_NS + 1
    assert not held.holds()
    assert held.holds()
    assert made.state.mode is StationMode.DISARMED


def test_a_hand_over_gives_the_lease_with_the_life_that_was_asked_for():
    host = Time()
    _, held = tenure(host)
    message = "a hand-over: expected a source that has the lease, nobody has it"
    with pytest.raises(SafetyError, match=says(message)):
        held.hand_over("learner", life_ns=None)
    assert held.take("teleop", life_ns=LIFE_NS).life_ns == LIFE_NS
    lease = held.hand_over("learner", life_ns=3)
    assert (lease.source, lease.life_ns) == ("learner", 3)
    assert held.grant == Grant(source="learner", profile="attended", lease=2)
    host.now_ns += 4
    assert held.grant is None


def test_ending_a_tenure_disarms_and_frees_the_lease():
    made, held = tenure(Time())
    held.end()
    made.arm(identity=FAKE, by="tester", grant=held.renewed())
    held.end()
    assert (made.state.mode, made.state.reason) == (StationMode.DISARMED, "")
    assert held.grant is None
    assert held.renewed() == Grant(source="local", profile="attended", lease=2)
    assert held.take("local", life_ns=None).number == 3


def test_limits_say_what_does_not_fit():
    with pytest.raises(RobotConfigError, match=says("the rig's arm file is for 'ur5e', the plant says 'ur10e'")):
        GateLimits.of(ARM, replace(SPEC, model="ur10e"), table_m=0.0, tick_s=0.01)
    high = ARM.joints[0].range_rad[1]
    message = f"joint base: file and arm leave no range ({high} .. {high} rad)"
    with pytest.raises(RobotConfigError, match=says(message)):
        GateLimits.of(ARM, replace(SPEC, q_min_rad=(high, *SPEC.q_min_rad[1:])), table_m=0.0, tick_s=0.01)


def test_every_limit_is_the_one_that_file_and_arm_give():
    spec = replace(SPEC, q_min_rad=(-1.0,) * 6, q_max_rad=(2.0,) * 6, qd_max_rad_s=(0.5,) * 6, n_outputs=3)
    motion, tool = ARM.motion, ARM.tool
    (x0, y0, z0), (x1, y1, z1) = motion.workspace_m
    rest_s = (
        motion.leash_m / motion.speed_m_s
        + motion.speed_m_s / motion.acceleration_m_s2
        + motion.acceleration_m_s2 / motion.jerk_m_s3
    )
    assert GateLimits.of(ARM, spec, table_m=0.125, tick_s=0.01) == GateLimits(
        q_min_rad=(-1.0,) * 6,
        q_max_rad=(2.0,) * 6,
        joint_step_rad=(0.5 * 0.01 * (1.0 + 1e-9),) * 6,
        workspace_m=((x0 - 0.01, y0 - 0.01, z0 - 0.005), (x1 + 0.01, y1 + 0.01, z1 + 0.01)),
        tip_min_m=0.125 + motion.table_clearance_m,
        tracking_error_rad=motion.tracking_error_rad,
        contact_n=motion.contact_force_n,
        force_max_n=motion.force_limit_n,
        impact_max_n=motion.impact_limit_n,
        opening_m=(0.0, tool.stroke_m),
        grip_force_n=tool.force_n,
        grip_speed_m_s=tool.speed_m_s,
        output_mask=0b111,
        state_max_age_ns=round(motion.state_max_age_s * 1e9),
        percept_max_age_ns=round((motion.percept_max_age_s + motion.intent_max_age_s + rest_s) * 1e9),
        intent_max_age_ns=round((motion.intent_max_age_s + rest_s) * 1e9),
    )


def test_each_joint_has_its_own_limits_and_ages_are_to_the_nanosecond():
    low, high = tuple(-1.0 - k for k in range(6)), tuple(0.5 + 0.25 * k for k in range(6))
    speeds = tuple(0.5 + 0.1 * k for k in range(6))
    slow = replace(ARM, motion=replace(ARM.motion, state_max_age_s=5.0, intent_max_age_s=5.0))
    limits = GateLimits.of(
        slow, replace(SPEC, q_min_rad=low, q_max_rad=high, qd_max_rad_s=speeds), table_m=0.0, tick_s=1.0
    )
    plain = GateLimits.of(ARM, SPEC, table_m=0.0, tick_s=1.0)
    assert limits.q_min_rad == (*low[:2], max(low[2], ARM.joints[2].range_rad[0]), *low[3:])
    assert limits.q_max_rad == high
    assert limits.joint_step_rad == pytest.approx(speeds)
    assert limits.state_max_age_ns == 5 * 10**9
    shorter_s = 5.0 - ARM.motion.intent_max_age_s
    assert abs(limits.intent_max_age_ns - plain.intent_max_age_ns - shorter_s * 1e9) <= 1.0


@pytest.mark.parametrize("name", ["q_min_rad", "q_max_rad", "qd_max_rad_s"])
def test_an_arm_of_another_number_of_joints_is_an_error_and_never_cut_short(name):
    longer = replace(SPEC, **{name: (*getattr(SPEC, name), 0.0)})
    with pytest.raises(ValueError, match="zip"):
        GateLimits.of(ARM, longer, table_m=0.0, tick_s=0.01)
    with pytest.raises(ValueError, match="zip"):
        check_profile_fits(profile(), longer)


@pytest.mark.parametrize("i", range(6))
def test_a_profile_at_the_arms_limits_and_a_rounding_passes_and_the_next_float_does_not(i):
    edge = replace(
        profile().joints[i],
        range_rad=(SPEC.q_min_rad[i] - 1e-3, SPEC.q_max_rad[i] + 1e-3),
        speed_rad_s=SPEC.qd_max_rad_s[i] + 1e-3,
    )
    (low, high), speed = edge.range_rad, edge.speed_rad_s

    def held(joint):
        return profile(joints=tuple(joint if k == i else j for k, j in enumerate(profile().joints)))

    check_profile_fits(held(edge), SPEC)
    for beyond in (
        replace(edge, range_rad=(math.nextafter(low, -math.inf), high)),
        replace(edge, range_rad=(low, math.nextafter(high, math.inf))),
        replace(edge, speed_rad_s=math.nextafter(speed, math.inf)),
    ):
        with pytest.raises(RobotConfigError):
            check_profile_fits(held(beyond), SPEC)


@pytest.mark.parametrize("i", range(6))
def test_a_profile_may_differ_from_the_arm_by_rounding_and_no_more(i):
    held = profile()
    low, high = held.joints[i].range_rad
    speed = held.joints[i].speed_rad_s

    def but(values, value):
        return tuple(value if k == i else v for k, v in enumerate(values))

    for by, fits in ((0.0009, True), (0.0011, False)):
        for spec, message in (
            (replace(SPEC, q_min_rad=but(SPEC.q_min_rad, low + by)),
             f"limits profile {held.name}: joints[{i}].range_rad: expected a range within the arm's own "
             f"{low + by:.3f} .. {SPEC.q_max_rad[i]:.3f} rad, the file gives {low:.3f} .. {high:.3f}: "
             "narrow it there"),
            (replace(SPEC, q_max_rad=but(SPEC.q_max_rad, high - by)),
             f"limits profile {held.name}: joints[{i}].range_rad: expected a range within the arm's own "
             f"{SPEC.q_min_rad[i]:.3f} .. {high - by:.3f} rad, the file gives {low:.3f} .. {high:.3f}: "
             "narrow it there"),
            (replace(SPEC, qd_max_rad_s=but(SPEC.qd_max_rad_s, speed - by)),
             f"limits profile {held.name}: joints[{i}].speed_rad_s: expected at most the arm's own {speed - by:.3f} "
             f"rad/s, the file gives {speed:.3f}: lower it there"),
        ):  # fmt: skip
            if fits:
                check_profile_fits(held, spec)
            else:
                with pytest.raises(RobotConfigError, match=says(message)):
                    check_profile_fits(held, spec)
