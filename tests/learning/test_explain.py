import pytest

from config.learning import SubgoalSelection
from learning.explain import explain_graph
from learning.graph import Graph
from learning.interfaces import Attempt, TrialOutcome

N = 3


def attempt(epoch: int, subgoal: int, state: tuple[bool, ...], outcome: TrialOutcome) -> Attempt:
    is_achieved = outcome is TrialOutcome.ACHIEVED
    after = tuple(on or (is_achieved and i == subgoal) for i, on in enumerate(state))
    return Attempt(
        epoch=epoch, goal=subgoal, subgoal=subgoal, state=state, state_after=after, outcome=outcome, predicted=0.5,
        skill=0.9, n_steps=20,
    )  # fmt: skip


@pytest.fixture(scope="module")
def graph() -> Graph:
    """Goal 2 came about with goal 0 on and goal 1 off, and was blocked otherwise."""
    graph = Graph(n_goals=N, config=SubgoalSelection(hazard=0.0))
    cases = [((True, False, False), True), ((False, False, False), False), ((True, True, False), False)]
    for epoch in range(12):
        for state, is_achieved in cases:
            outcome = TrialOutcome.ACHIEVED if is_achieved else TrialOutcome.BLOCKED
            graph.learn(attempt(epoch, 2, state, outcome))
    return graph


def test_it_names_what_must_be_on_and_what_must_be_off(graph):
    told = explain_graph(graph)[2]
    assert (told.needs_on, told.needs_off) == ((0,), (1,))
    assert told.probability > 0.9
    assert (told.n_for + told.n_for_before, told.n_against + told.n_against_before) == (36, 0)


def test_evidence_of_rules_that_are_gone_is_told_apart():
    graph = Graph(n_goals=N, config=SubgoalSelection(hazard=0.01))
    on, off = (True, False, False), (False, False, False)
    for epoch, (state, is_achieved) in enumerate([(on, True), (off, False)] * 15 + [(on, False), (off, True)] * 15):
        graph.learn(attempt(epoch, 2, state, TrialOutcome.ACHIEVED if is_achieved else TrialOutcome.BLOCKED))
    told = explain_graph(graph)[2]
    assert (told.needs_on, told.needs_off) == ((), (0,))
    assert told.changed_epoch is not None
    assert 30 <= told.changed_epoch < 45
    assert told.n_against == 0
    assert told.n_for == 60 - told.changed_epoch
    assert told.n_for_before + told.n_against_before == told.changed_epoch
    assert told.n_against_before >= 15


def test_a_literals_probability_is_that_of_all_conjunctions_that_hold_it(graph):
    told = {(literal.goal, literal.is_on): literal.probability for literal in explain_graph(graph)[2].literals}
    assert told[(0, True)] > 0.9
    assert told[(1, False)] > 0.9
    assert (0, False) not in told


def test_the_plan_from_a_fresh_table_goes_through_what_is_needed(graph):
    assert explain_graph(graph)[2].plan == (0, 2)


def test_of_a_goal_never_tried_nothing_is_claimed(graph):
    told = explain_graph(graph)[0]
    assert (told.needs_on, told.needs_off, told.n_for, told.n_against) == ((), (), 0, 0)
    assert told.changed_epoch is None
