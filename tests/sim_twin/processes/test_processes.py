"""Commander, servo process and bus die, freeze or lie while the arm is under way: judged on the twin's own joints.

In wall time: what is not as asked fails, unless the kernel counted that processes waited for processors meanwhile.
"""

import pytest

from sim_twin.processes import CASES, ProcessCourse
from tests.support.judged_course import JudgedCourse

pytestmark = pytest.mark.realtime

ESSENTIAL = ("servo_process_killed", "commander_killed")
REASONS = {
    "commander_frozen_1s": "stale_intent",
    "commander_slow_300ms": "stale_intent",
    "intent_not_a_number": "not_finite",
    "garbage_bytes": "malformed",
    "garbage_schema": "malformed",
    "old_sequence": "sequence",
    "lease_of_another": "it was armed for",
    "servo_process_killed": "stale_state",
    "servo_process_frozen": "stale_state",
    "bus_cut": "stale_state",
}


def wrong_with(case, outcome):
    wrong = list(outcome.failures())
    reason = REASONS.get(case.name, "")
    if not outcome.reason.startswith(reason):
        wrong.append(f"expected {reason}, came {outcome.reason}")
    return wrong


@pytest.fixture(scope="module")
def course():
    with ProcessCourse("127.0.0.43") as opened:
        made = JudgedCourse(opened, wrong_with)
        yield made
        made.close()


@pytest.mark.parametrize("case", [c for c in CASES if c.name in ESSENTIAL], ids=lambda c: c.name)
def test_an_arm_whose_processes_fail_rests_in_time_and_waits_for_a_person(course, case):
    outcome = course.run(case)
    assert outcome.ramp.speed_m_s > 0.2


@pytest.mark.slow
@pytest.mark.parametrize("case", [c for c in CASES if c.name not in ESSENTIAL], ids=lambda c: c.name)
def test_so_does_it_in_every_other_case(course, case):
    course.run(case)
