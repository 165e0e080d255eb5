"""What a command is judged by: the ones before it, or rest where one gave way to a push."""

import pytest
from msgspec.structs import replace

from robot.safety import Reason
from robot.safety.course import JointCourse
from tests.support.profiles import envelope, profile

ENVELOPE = envelope(0.01, joints=tuple(replace(j, jerk_rad_s3=j.stop_jerk_rad_s3) for j in profile().joints))
END = ENVELOPE.joints[0]
GAIN = END.gain_rad
REST = (0.0,) * 6


def at(x):
    return (x, 0.0, 0.0, 0.0, 0.0, 0.0)


def went(steps, *, pushed=()):
    """Return a course that took steps of joint 1, each asked of it, pushed at the numbers given."""
    course, x = JointCourse(ENVELOPE), 0.0
    for k, step in enumerate(steps):
        x += step
        assert course.check(at(x), at(x) if k in pushed else None) is None, k
        course.add(at(x), is_pushed=k in pushed)
    return course, x


def refused(course, x, pushed_rad=None):
    refusal = course.check(at(x), pushed_rad)
    return None if refusal is None else refusal.reason


def test_holding_still_at_rest_is_at_rest_and_after_motion_only_when_its_acceleration_is_over():
    course, x = went([GAIN / 4, 0.0])
    assert not course.is_at_rest
    for _ in range(2):
        assert course.check(at(x), None) is None
        course.add(at(x), is_pushed=False)
    assert course.is_at_rest


def test_holding_still_at_once_out_of_full_motion_is_refused():
    course, x = went([GAIN * k for k in (1, 2, 3)])
    assert refused(course, x) is Reason.JOINT_ACCELERATION


def test_turning_an_acceleration_round_in_one_tick_is_refused_and_ending_it_is_not():
    course, x = went([GAIN * k for k in (1, 2, 3)])
    assert refused(course, x + 2.0 * GAIN) is Reason.JOINT_JERK
    assert refused(course, x + 3.0 * GAIN) is None


@pytest.mark.parametrize("pushed", [True, False])
def test_only_what_is_pushed_gives_way_as_fast_as_it_will(pushed):
    course, _ = went([0.0])
    measured = at(0.02) if pushed else None
    assert refused(course, 0.02, measured) is (None if pushed else Reason.JOINT_ACCELERATION)
    assert refused(course, 0.02 + 1.001 * GAIN, measured) is Reason.JOINT_ACCELERATION


def test_what_gave_way_may_stand_at_once_or_start_from_rest_and_is_held_to_that_from_then_on():
    steps = [0.02, 0.0, GAIN / 3, GAIN]
    course, x = went(steps, pushed={0})
    assert refused(course, x + 2.001 * GAIN) is Reason.JOINT_ACCELERATION
    course, x = went([0.02, GAIN / 3], pushed={0})
    assert refused(course, x - 0.8 * GAIN) is Reason.JOINT_JERK


def test_what_was_pushed_and_did_not_give_way_may_go_on():
    steps = [GAIN * k / 2 for k in (1, 2, 3, 4)] + [2.0 * GAIN] * 4
    went(steps, pushed={3, 4})
    course, x = went(steps, pushed={3, 4, 7})
    assert refused(course, x + 2.0 * GAIN) is None
    assert refused(course, x) is None  # from rest, for a push may have stopped it
    assert refused(course, x - 1.5 * GAIN) is not None


def test_two_ticks_after_a_push_there_is_one_course_again():
    course, x = went([GAIN, GAIN, GAIN, GAIN], pushed={1})
    assert len(course._befores) == 1
    assert refused(course, x) is None


def test_a_seed_is_rest():
    course, _ = went([GAIN, 2.0 * GAIN])
    course.seed(at(1.0))
    assert course.is_at_rest
    assert refused(course, 1.0 + 2.0 * GAIN) is Reason.JOINT_ACCELERATION


def test_what_gave_way_may_go_on_at_its_speed_though_that_is_too_much_from_rest():
    course, x = went([1.12 * GAIN], pushed={0})
    assert refused(course, x + 1.12 * GAIN) is None
    course.seed(at(0.0))
    assert refused(course, 1.12 * GAIN) is Reason.JOINT_ACCELERATION


def test_who_kept_to_no_course_and_gave_way_goes_on_from_the_true_one_or_from_rest_and_no_other():
    course, x = went([-1.12 * GAIN, 1.12 * GAIN], pushed={0, 1})
    assert refused(course, x + 1.12 * GAIN) is Reason.JOINT_JERK
    assert refused(course, x + 0.9 * GAIN) is None


@pytest.mark.parametrize(("more", "passes"), [(0.99, True), (1.5, False)])
def test_what_is_pushed_against_its_way_gains_no_more_on_its_last_step_than_any(more, passes):
    course, x = went([GAIN, 2.0 * GAIN, 3.0 * GAIN])
    came = refused(course, x + (3.0 + more) * GAIN, at(x))
    assert came is (None if passes else Reason.JOINT_ACCELERATION)
