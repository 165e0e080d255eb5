"""An epoch may be given to what its own goal needs: where in doubt that is tested, though the epoch fail for it."""

import numpy as np
import pytest

from config.learning import Experiment, SubgoalSelection
from learning.abstract.rules import needs
from learning.agent import Agent
from learning.interfaces import Attempt, TrialOutcome
from learning.subgoal_graph import GraphSelector
from tests.support.toy_learner import N_GOALS, ToyExperts, ToyGoalSelector, ToyJudge, ToyStation

ACHIEVED, BLOCKED = TrialOutcome.ACHIEVED, TrialOutcome.BLOCKED
GOAL = 3
"""Needs goal 1; believed to need goal 0 off too since it was blocked with goal 0 on, and not tried so again."""


def flags(*goals):
    return tuple(i in goals for i in range(N_GOALS))


def in_doubt(*, curiosity):
    """Return a selector that has just come to believe that its goal needs goal 1, and goal 0 off."""
    config = SubgoalSelection(curiosity=curiosity, retest=0.0, hazard=0.002, local_change=0.8, literal_cost=2.0)
    selector = GraphSelector(n_goals=N_GOALS, config=config, rng=np.random.default_rng(0))

    def learn(subgoal, *before, outcome=ACHIEVED, epoch):
        after = (*before, subgoal) if outcome is ACHIEVED else before
        selector.update(
            Attempt(
                epoch=epoch, goal=subgoal, subgoal=subgoal, state=flags(*before), state_after=flags(*after),
                outcome=outcome, predicted=0.5, skill=0.95, n_steps=10,
            )
        )  # fmt: skip

    for epoch in range(20):
        for other in (0, 1, 2):
            for before in ((), (0,), (1,), (2,), (0, 1), (GOAL,)):
                if other not in before:
                    learn(other, *before, epoch=epoch)
        for before in ((), (2,), (0,)):
            learn(GOAL, *before, outcome=BLOCKED, epoch=epoch)
        for before in ((1,), (1, 2)):
            learn(GOAL, *before, epoch=epoch)
    assert selector.graph.most_probable(GOAL) == needs([1])
    for epoch in range(20, 30):
        learn(GOAL, 0, 1, outcome=BLOCKED, epoch=epoch)
        if selector.graph.most_probable(GOAL) != needs([1]):
            break
    learn(GOAL, 1, epoch=30)
    assert selector.graph.most_probable(GOAL) == needs([1], off=[0])
    assert 0.1 < selector.predict_allowed(GOAL, flags(0, 1)) < 0.4
    return selector


def epoch_of(selector, *, shut_by_goal_0):
    """Pursue the goal for one epoch where it needs goal 1, and perhaps goal 0 off; all moves are mastered."""

    def allowed(goal, state, epoch):
        return goal != GOAL or (state[1] and not (shut_by_goal_0 and state[0]))

    experts = ToyExperts(np.random.default_rng(0))
    experts.load_state_dict(experts.state_dict() | {"worth": 9.0 * np.eye(N_GOALS), "results": np.full(N_GOALS, 0.95)})
    agent = Agent(
        goal_selector=ToyGoalSelector(np.random.default_rng(0)),
        subgoal_selector=selector,
        experts=experts,
        judge=ToyJudge(),
        protocol=Experiment(steps=30),
    )
    return agent.learn_epoch(ToyStation(allowed), epoch=40, seed=1, goal=GOAL)


def tried(record):
    return [(entry.attempt.subgoal, entry.attempt.outcome) for entry in record.trials]


def test_where_its_own_goals_needs_are_in_doubt_an_epoch_is_given_to_testing_them():
    selector = in_doubt(curiosity=1.0)
    doubt = selector.predict_allowed(GOAL, flags(0, 1))
    record = epoch_of(selector, shut_by_goal_0=True)
    assert tried(record)[:3] == [(0, ACHIEVED), (1, ACHIEVED), (GOAL, BLOCKED)]
    assert not record.is_achieved
    assert selector.predict_allowed(GOAL, flags(0, 1)) < doubt
    assert selector.graph.most_probable(GOAL) == needs([1], off=[0])


def test_a_needless_need_is_found_out_in_an_epoch_of_its_own_goal():
    selector = in_doubt(curiosity=1.0)
    doubt = selector.predict_allowed(GOAL, flags(0, 1))
    record = epoch_of(selector, shut_by_goal_0=False)
    assert tried(record) == [(0, ACHIEVED), (1, ACHIEVED), (GOAL, ACHIEVED)]
    assert selector.predict_allowed(GOAL, flags(0, 1)) > doubt


@pytest.mark.parametrize("shut_by_goal_0", [False, True])
def test_without_curiosity_the_epoch_goes_to_the_goal_by_the_way_that_is_believed(shut_by_goal_0):
    record = epoch_of(in_doubt(curiosity=0.0), shut_by_goal_0=shut_by_goal_0)
    assert tried(record) == [(1, ACHIEVED), (GOAL, ACHIEVED)]
