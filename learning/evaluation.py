"""Evaluation: learning off, fresh seeds. A pure function of what was learnt, the seeds and the epoch's rules."""

from collections.abc import Callable
from typing import Protocol

import msgspec

from learning.agent import Agent
from learning.interfaces import GoalState
from learning.rows import EvaluationRow
from learning.seeds import evaluation_seed
from robot.station import Station

__all__ = ["GoalScore", "GoalTest", "Learner", "evaluation_row", "learnt_graph", "run_test"]

HALF = 0.5
"""A goal is predicted to be allowed where that is more probable than not."""


class Learner(Protocol):
    """An agent and the station it acts through; whoever makes one also closes it."""

    @property
    def agent(self) -> Agent:
        """Who acts."""
        ...

    @property
    def station(self) -> Station:
        """Where."""
        ...

    def close(self) -> None:
        """Release the station. Idempotent."""
        ...


class GoalTest(msgspec.Struct, frozen=True, kw_only=True):
    """The test epochs of one goal at one evaluation."""

    root_seed: int
    epoch: int
    rules_epoch: int
    goal: int
    n_tests: int
    n_trials: int
    """Trials that an epoch has; a failure counts as so many."""


class GoalScore(msgspec.Struct, frozen=True, kw_only=True):
    """What came of them."""

    n_tests: int
    n_successes: int
    n_void: int
    trials_achieved: int
    trials_all: int
    n_steps: int


def run_test(
    agent: Agent, station: Station, test: GoalTest, *, when_tested: Callable[[], object] = lambda: None
) -> GoalScore:
    """Pursue the goal from fresh table layouts.

    A void test epoch is repeated with another seed, as often as there are tests at most.

    Args:
        agent: who acts.
        station: where.
        test: what is tested.
        when_tested: called after every test epoch, void ones too.
    """
    n_tests = n_successes = n_void = trials_achieved = trials_all = n_steps = 0
    for attempt in range(2 * test.n_tests):
        seed = evaluation_seed(
            test.root_seed, epoch=test.epoch, rules_epoch=test.rules_epoch, goal=test.goal, test=attempt
        )
        record = agent.test_epoch(station, epoch=test.rules_epoch, seed=seed, goal=test.goal)
        n_steps += record.n_steps
        when_tested()
        if record.is_void:
            n_void += 1
            continue
        n_tests += 1
        n_successes += record.is_achieved
        trials_achieved += len(record.trials) if record.is_achieved else 0
        trials_all += len(record.trials) if record.is_achieved else test.n_trials
        if n_tests == test.n_tests:
            break
    return GoalScore(
        n_tests=n_tests,
        n_successes=n_successes,
        n_void=n_void,
        trials_achieved=trials_achieved,
        trials_all=trials_all,
        n_steps=n_steps,
    )


def evaluation_row(test: GoalTest, score: GoalScore, graph: tuple[int, int] | None) -> EvaluationRow:
    """Return the row of one goal. graph: states compared and how many of them wrong; None where no graph is learnt."""
    return EvaluationRow(
        epoch=test.epoch,
        rules_epoch=test.rules_epoch,
        goal=test.goal,
        **msgspec.structs.asdict(score),
        graph_cases=graph[0] if graph else None,
        graph_wrong=graph[1] if graph else None,
    )


def learnt_graph(agent: Agent) -> Callable[[int, GoalState], bool] | None:
    """Return the agent's own word on whether a goal can come about in a goal-state, None if it learns no graph."""
    probability = getattr(agent.subgoal_selector, "predict_allowed", None)
    if probability is None:
        return None
    return lambda goal, state: probability(goal, state) > HALF
