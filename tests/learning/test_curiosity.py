"""What is tried in order to know more, where no plan and no walk would come by it."""

import numpy as np
import pytest

from config.learning import SubgoalSelection
from learning import curiosity
from learning.abstract.rules import needs
from learning.curiosity import Curiosity
from learning.graph import Graph
from learning.interfaces import Attempt, TrialOutcome
from learning.preconditions import START

N = 4


def flags(*goals):
    return tuple(i in goals for i in range(N))


def learn(graph, subgoal, before=(), outcome=TrialOutcome.ACHIEVED, *, n=20):
    after = (*before, subgoal) if outcome is TrialOutcome.ACHIEVED else before
    for epoch in range(n):
        graph.learn(
            Attempt(
                epoch=epoch,
                goal=subgoal,
                subgoal=subgoal,
                state=flags(*before),
                state_after=flags(*after),
                holds=None,
                holds_after=None,
                outcome=outcome,
                predicted=0.5,
                skill=0.95,
                n_steps=10,
            )
        )


@pytest.fixture
def graph():
    """Goal 3 needs goal 1, and was never tried with goal 0 on; the others need nothing."""
    learnt = Graph(n_goals=N, config=SubgoalSelection(hazard=0.002, local_change=0.8, literal_cost=2.0))
    for goal in (0, 1, 2):
        for before in ((), (0,), (1,), (2,), (3,)):
            if goal not in before:
                learn(learnt, goal, before)
    learn(learnt, 3, outcome=TrialOutcome.BLOCKED)
    learn(learnt, 3, (2,), outcome=TrialOutcome.BLOCKED)
    learn(learnt, 3, (1,))
    learn(learnt, 3, (1, 2))
    assert learnt.most_probable(3) == needs([1])
    return learnt


def probes(graph, goal, *, n_epochs=60, **config):
    """Return the ways on which an epoch's first steps were taken out of curiosity."""
    curious = Curiosity(
        config=SubgoalSelection(**{"least_doubt": 0.005, "retest": 0.0} | config), rng=np.random.default_rng(3)
    )
    ways = set()
    for _ in range(n_epochs):
        here, way = START, []
        while (step := curious.step(goal, here, graph)) is not None:
            way.append(step)
            here = here.after(step, graph.undone(step))
        ways.add(tuple(way))
    return ways


def test_what_may_have_to_be_off_is_tried_though_no_walk_comes_by_it(graph, monkeypatch):
    monkeypatch.setattr(curiosity, "random_walks", lambda *_, **__: iter(()))
    ways = probes(graph, 2, curiosity=1.0)
    assert any(way[-1:] == (3,) and {0, 1} <= set(way) for way in ways), ways


def test_what_was_tried_with_it_on_is_no_suspicion_any_more(graph, monkeypatch):
    monkeypatch.setattr(curiosity, "random_walks", lambda *_, **__: iter(()))
    learn(graph, 3, (0, 1), n=5)
    ways = probes(graph, 2, curiosity=1.0)
    assert not any(way[-1:] == (3,) and {0, 1} <= set(way) for way in ways), ways


def test_a_retest_may_take_the_whole_epoch(graph):
    # Goal 2 is shut by goal 0 for good: an epoch of goal 2 in which goal 0 is achieved is lost.
    learn(graph, 2, (0,), outcome=TrialOutcome.BLOCKED, n=40)
    learn(graph, 3, (0, 1), outcome=TrialOutcome.BLOCKED, n=40)
    assert graph.most_probable(2) == needs(off=[0])
    assert graph.most_probable(3) == needs([1], off=[0])
    assert any(way[-1:] == (3,) and 0 in way for way in probes(graph, 2, retest=1.0))
    assert not any(way[-1:] == (3,) and 0 in way for way in probes(graph, 2, curiosity=1.0, least_doubt=0.0))
