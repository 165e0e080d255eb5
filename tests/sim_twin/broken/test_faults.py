"""Faults against an arm under way, through servo process and genuine client; judged on the twin's own joints.

In wall time. What is not as asked fails, unless the kernel counted that processes waited for processors meanwhile: then
it is tried again, and where that was so in every try the fault is told as skipped, not judged. A run that judged fewer
than three quarters of its faults fails where the machine was not overbooked in all, and one that judged none always.
"""

import pytest

from sim_twin.broken import TRIALS, Course, CutShortError, DisturbedError
from sim_twin.paired.machine import Spare
from tests.support.judged_course import JudgedCourse
from tests.support.overbooked import Overbooked

pytestmark = pytest.mark.realtime

ESSENTIAL = ("rtde_dropped",)
"""Each takes a controller and an arm of its own, and 13 s; the others are the slow run's."""
REASONS = {
    "link": "stale_state",
    "rtde": "stale_state",
    "interfaces": "stale_state",
    "all": "stale_state",
    "ticks": "stale_state",
    "joints": "tracking",
    "servo": "stale_state",
    "program": "arm_refused",
    "tool": "arm_refused",
    "payload": "arm_refused",
}


def wrong_with(trial, outcome):
    wrong = list(outcome.failures())
    expected = REASONS.get(trial.name.split("_")[0])
    if trial.is_stop and expected is not None and (outcome.raised is None or outcome.raised.what != expected):
        wrong.append(f"expected {expected} to be raised")
    return wrong


@pytest.fixture(scope="module")
def bench():
    with Course("127.0.0.33") as opened:
        made = JudgedCourse(opened, wrong_with)
        yield made
        made.close()


@pytest.mark.parametrize("trial", [t for t in TRIALS if t.name in ESSENTIAL], ids=lambda t: t.name)
def test_an_arm_under_way_comes_to_rest_and_waits_for_somebody(bench, trial):
    outcome = bench.run(trial)
    assert outcome.stop.speed_rad_s > 0.3


@pytest.mark.slow
@pytest.mark.parametrize("trial", [t for t in TRIALS if t.name not in ESSENTIAL], ids=lambda t: t.name)
def test_every_other_fault_is_told_or_borne(bench, trial):
    bench.run(trial)


class Stub:
    """A course whose tries all end alike."""

    def __init__(self, ending):
        self.ending, self.n = ending, 0

    def run(self, trial):
        self.n += 1
        return self.ending()


def disturbed():
    raise DisturbedError("0% of the processors' time to spare")


def late():
    class Late:
        raised = None

        def failures(self):
            return ("told after 150 ms",)

        def details(self):
            return {}

    return Late()


def shared(monkeypatch, *shares):
    """Let the kernel count these shares, one after the other, and then the last for ever."""
    left = list(shares)
    monkeypatch.setattr(Overbooked, "share", lambda _: left.pop(0) if len(left) > 1 else left[0])


BUSY, QUIET = 0.6, 0.02


@pytest.mark.parametrize(
    ("shares", "verdict", "n"),
    [
        ((QUIET,), pytest.fail.Exception, 1),
        ((BUSY, QUIET), pytest.fail.Exception, 2),
        ((BUSY, BUSY, QUIET), pytest.fail.Exception, 3),
        ((BUSY,), pytest.skip.Exception, 3),
    ],
)
def test_what_is_not_as_asked_fails_unless_the_machine_was_overbooked_in_every_try(monkeypatch, shares, verdict, n):
    shared(monkeypatch, *shares)
    bench = JudgedCourse(Stub(late), wrong_with)
    with pytest.raises(verdict, match=f"{TRIALS[0].name}.*told after 150 ms"):
        bench.run(TRIALS[0])
    assert bench.course.n == n
    assert (bench.tried, len(bench.judged)) == ([TRIALS[0].name], verdict is pytest.fail.Exception)


@pytest.mark.parametrize(("share", "verdict"), [(QUIET, pytest.fail.Exception), (BUSY, pytest.skip.Exception)])
def test_a_disturbance_leaves_a_fault_unjudged_on_an_overbooked_machine_only(monkeypatch, share, verdict):
    shared(monkeypatch, share)
    bench = JudgedCourse(Stub(disturbed), wrong_with)
    with pytest.raises(verdict, match=f"{TRIALS[0].name}.*of the processors"):
        bench.run(TRIALS[0])
    assert bench.course.n == 1


@pytest.mark.parametrize(
    ("n_judged", "n_tried", "share", "is_enough"),
    [
        *((3, 4, QUIET, True), (2, 4, QUIET, False), (22, 30, QUIET, False), (23, 30, QUIET, True)),
        *((1, 4, BUSY, True), (0, 4, BUSY, False), (0, 0, QUIET, True), (0, 0, BUSY, True)),
    ],
)
def test_a_run_that_judged_too_little_fails_and_names_what_it_did_not_judge(
    monkeypatch, n_judged, n_tried, share, is_enough
):
    shared(monkeypatch, share)
    bench = JudgedCourse(None, wrong_with)
    bench.tried = [f"fault_{k}" for k in range(n_tried)]
    bench.judged = bench.tried[:n_judged]
    if is_enough:
        bench.close()
        return
    with pytest.raises(pytest.fail.Exception, match=f"fault_{n_tried - 1};"):
        bench.close()


@pytest.mark.parametrize(("share", "error"), [(0.5, CutShortError), (0.0, DisturbedError)])
def test_a_course_that_is_cut_short_counts_as_disturbed_on_a_busy_machine_only(monkeypatch, share, error):
    def cut(_self, _trial):
        raise DisturbedError("before anything went wrong")

    monkeypatch.setattr(Spare, "share", lambda _: share)
    monkeypatch.setattr(Course, "_try", cut)
    with Course("127.0.0.33") as course, pytest.raises(error, match="before anything"):
        course.run(TRIALS[0])
