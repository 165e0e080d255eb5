"""Control experiments: which ones a revision calls for, when they are done, and that they are not lost."""

from config.learning import SubgoalSelection
from learning.abstract.rules import needs
from learning.controls import Controls, probe_of, violations
from learning.graph import Graph
from learning.interfaces import Attempt, TrialOutcome
from learning.preconditions import Needs, Situation

N = 4


def flags(*goals):
    return tuple(i in goals for i in range(N))


def attempt(subgoal, before, outcome, epoch):
    after = (*before, subgoal) if outcome is TrialOutcome.ACHIEVED else before
    return Attempt(
        epoch=epoch, goal=subgoal, subgoal=subgoal, state=flags(*before), state_after=flags(*after), holds=None,
        holds_after=None, outcome=outcome, predicted=0.5, skill=0.95, n_steps=10,
    )  # fmt: skip


def learn(graph, controls, subgoal, before=(), outcome=TrialOutcome.ACHIEVED, epoch=0):
    for finding in graph.learn(attempt(subgoal, before, outcome, epoch)):
        controls.take_in(finding, graph)


def any_epoch(_):
    return True


def a_goal_that_needed_another_and_now_does_not():
    graph, controls = Graph(n_goals=N, config=SubgoalSelection(hazard=0.01, local_change=0.8)), Controls()
    for epoch in range(10):
        learn(graph, controls, 3, (1,), epoch=epoch)
        learn(graph, controls, 3, (), TrialOutcome.BLOCKED, epoch=epoch)
    assert graph.most_probable(3) == needs([1])
    while controls.begin(graph, any_epoch):
        pass
    for epoch in range(10, 20):
        learn(graph, controls, 3, epoch=epoch)
        if graph.most_probable(3) != needs([1]):
            return graph, controls
    raise AssertionError("ten successes without goal 1 revised nothing")


def test_each_literal_is_turned_round_in_turn():
    assert violations(needs([0], [2])) == (Needs(0b000, 0b101), Needs(0b101, 0b000))
    assert violations(needs()) == ()


def test_a_probe_leads_to_where_the_needs_hold():
    graph = Graph(n_goals=N, config=SubgoalSelection())
    probe = probe_of(3, needs([1]), graph)
    assert probe.steps == (1, 3)
    assert probe.situation == Situation(0b0010, 0b0010)
    assert probe.spot == (3, Situation(0b0010, 0b0010))


def test_after_a_revision_the_old_way_is_tried_once_more_and_a_block_there_shows_the_contrary():
    graph, controls = a_goal_that_needed_another_and_now_does_not()
    probe = controls.begin(graph, any_epoch)
    assert probe is not None
    assert probe.steps == (1, 3)
    learn(graph, controls, 3, (1,), TrialOutcome.BLOCKED, epoch=30)
    learn(graph, controls, 3, epoch=31)
    learn(graph, controls, 3, (1,), TrialOutcome.BLOCKED, epoch=32)
    assert graph.most_probable(3) == needs(off=[1])


def test_what_was_tried_is_struck_off():
    graph, controls = a_goal_that_needed_another_and_now_does_not()
    learn(graph, controls, 3, (1,), epoch=30)
    assert (1, 3) not in [probe.steps for probe in iter(lambda: controls.begin(graph, any_epoch), None)]


def test_a_control_waits_for_an_epoch_that_it_fits_and_is_given_up_after_three_begun():
    graph, controls = a_goal_that_needed_another_and_now_does_not()
    assert controls.begin(graph, lambda _: False) is None
    begun = [controls.begin(graph, lambda probe: probe.steps == (1, 3)) for _ in range(5)]
    assert [probe is not None for probe in begun] == [True, True, True, False, False]


def test_what_is_to_be_done_survives_a_checkpoint():
    graph, controls = a_goal_that_needed_another_and_now_does_not()
    restored = Controls()
    restored.load_state_dict(controls.state_dict())
    assert restored.begin(graph, any_epoch) == controls.begin(graph, any_epoch)
