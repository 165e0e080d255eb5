"""Goals are found in percepts that anybody made; what always came before them is taken to be needed."""

import msgspec
import pytest

from learning.demonstrations import shown_in
from learning.interfaces import TrialOutcome
from learning.preceding import ENOUGH, imagined, preceding
from robot.messages import GripState, Percept

STEP_S = 0.05
LIT, AT = 2, 3
"""What the judge of these tests looks at: the first grip of an opening that says so."""


class Judge:
    """Two goals: the opening says in bits which hold; distances say whose place the tool is at."""

    n_goals = 2

    def achieved(self, percept):
        return tuple(state > 0.5 for state in percept.button_states)

    def is_hand_free(self, goal, percept):
        return True

    def is_at_place(self, goal, percept):
        return percept.distances_m[goal] < 0.01


def percept(n, distances, states, step_s=STEP_S):
    return Percept(
        stamp_ns=round(n * step_s * 1e9), distances_m=distances, button_states=states, ages_s=(0.0,) * 4,
        valid=(True,) * 4, objects=(), tcp_position_m=(0.0, 0.0, 0.0),
        grip=GripState(opening_m=0.0, is_moving=False, has_object=False), is_in_contact=False,
    )  # fmt: skip


def ways(rows, **options):
    percepts = [percept(n, distances, states, **options) for n, (distances, states) in enumerate(rows)]
    return list(shown_in(percepts, Judge(), epoch=4, step_s=STEP_S))


FAR, AT_0, AT_1 = (0.3, 0.3), (0.0, 0.3), (0.3, 0.0)
NONE, FIRST, BOTH = (0.0, 0.0), (1.0, 0.0), (1.0, 1.0)


def test_a_way_leads_from_the_goal_before_to_where_the_next_comes_about():
    rows = [(FAR, NONE)] * 4 + [(AT_0, FIRST), (FAR, FIRST), (FAR, FIRST), (AT_1, BOTH)]
    first, second = ways(rows)
    assert (first.attempt.subgoal, second.attempt.subgoal) == (0, 1)
    assert first.distances_m == (FAR, FAR, FAR, AT_0)
    assert second.distances_m == (FAR, FAR, AT_1)
    assert (second.attempt.state, second.attempt.state_after) == ((True, False), (True, True))
    assert (second.begun_ns, second.ended_ns) == (200_000_000, 350_000_000)


def test_percepts_that_come_faster_than_time_steps_are_thinned_to_them():
    rows = [(FAR, NONE)] * 11 + [(AT_0, FIRST)]
    (way,) = ways(rows, step_s=0.01)
    assert len(way.distances_m) == 3  # after 50 ms, 100 ms, and where it came about


def test_a_visit_that_comes_to_nothing_is_a_blocked_trial_and_a_short_one_is_none():
    long = [(FAR, NONE)] + [(AT_1, NONE)] * 3 + [(FAR, NONE)] * 9
    (blocked,) = ways(long)
    assert (blocked.attempt.outcome, blocked.attempt.subgoal) == (TrialOutcome.BLOCKED, 1)
    assert blocked.distances_m == ()
    assert ways([(FAR, NONE)] + [(AT_1, NONE)] * 2 + [(FAR, NONE)] * 9) == []


def test_a_goal_that_comes_about_just_after_the_visit_was_not_blocked():
    rows = [(FAR, NONE)] + [(AT_0, NONE)] * 4 + [(FAR, NONE), (FAR, FIRST)]
    assert [way.attempt.outcome for way in ways(rows)] == [TrialOutcome.ACHIEVED]


def shown_with(states, goal=1):
    (way,) = ways([(FAR, NONE), (AT_1, (0.0, 1.0))])
    return [
        msgspec.structs.replace(way, attempt=msgspec.structs.replace(way.attempt, subgoal=goal, state=state))
        for state in states
    ]


@pytest.mark.parametrize(
    ("n_with", "n_without", "needed"),
    [(ENOUGH, 0, True), (ENOUGH - 1, 0, False), (19, 1, True), (18, 2, False)],
)
def test_what_came_before_nearly_all_of_enough_ways_is_taken_to_be_needed(n_with, n_without, needed):
    shown = shown_with([(True, False)] * n_with + [(False, False)] * n_without)
    assert preceding(shown, 2) == (frozenset(), frozenset({0} if needed else ()))


def test_of_a_chain_only_the_next_link_is_imagined_missing():
    needs = (frozenset(), frozenset({0}), frozenset({0, 1}))
    attempts = imagined(needs, epoch=9, skill=0.9)
    assert {(a.subgoal, a.state, a.outcome) for a in attempts} == {
        (1, (False, False, False), TrialOutcome.BLOCKED),
        (2, (True, False, False), TrialOutcome.BLOCKED),
    }
