"""Evaluations are a pure function of what was learnt, whoever does them."""

import os
import signal
from functools import partial

import pytest

from config.learning import Experiment
from learning.checkpoint import encode
from learning.evaluation import GoalTest, evaluation_row, learnt_graph, run_test
from learning.evaluation_pool import EvaluationPool
from tests.support.toy_learner import N_GOALS, ToyLearner, ToyStation, make_toy_learner, toy_maker

PROTOCOL = Experiment(steps=30)


class NoStation(ToyStation):
    """A station that must not be used."""

    def reset(self, *, seed, epoch):
        raise AssertionError("the workers were to do this")


class DeadlyStation(ToyStation):
    """A station that takes its process with it."""

    def reset(self, *, seed, epoch):
        os.kill(os.getpid(), signal.SIGKILL)


def make_deadly_learner():
    return ToyLearner(make_toy_learner(2, PROTOCOL).agent, DeadlyStation())


def make_unable_learner():
    raise SystemExit(7)


@pytest.fixture(scope="module")
def learner():
    learner = make_toy_learner(2, PROTOCOL)
    agent = learner.agent
    for epoch in range(25):
        agent.learn_epoch(learner.station, epoch=epoch, seed=epoch, goal=agent.choose_goal())
    return learner


def make_test(goal, *, epoch=25, rules_epoch=24, n_tests=6):
    return GoalTest(root_seed=1, epoch=epoch, rules_epoch=rules_epoch, goal=goal, n_tests=n_tests, n_trials=8)


TESTS = [make_test(goal) for goal in range(N_GOALS)]


def open_pool(*, station=None, make_learner=None, n_workers=0, report=lambda line: None):
    tester = make_toy_learner(0, PROTOCOL)
    return EvaluationPool(
        tester=tester.agent,
        station=station or tester.station,
        make_learner=make_learner or toy_maker(0, PROTOCOL),
        n_workers=n_workers,
        report=report,
    )


def pool_of(**given):
    pool = open_pool(**given)
    pool.wait_until_ready()
    return pool


def expected(learner, tests=TESTS):
    return [evaluation_row(test, run_test(learner.agent, learner.station, test), None) for test in tests]


def test_the_same_test_twice_gives_the_same_score_and_other_seeds_other_layouts(learner):
    score = run_test(learner.agent, learner.station, TESTS[0])
    assert run_test(learner.agent, learner.station, TESTS[0]) == score
    others = {run_test(learner.agent, learner.station, make_test(0, epoch=epoch)).n_steps for epoch in range(30, 36)}
    assert len(others) > 1


def test_a_failure_counts_as_all_trials_of_an_epoch(learner):
    untrained = make_toy_learner(2, PROTOCOL)
    score = run_test(untrained.agent, untrained.station, make_test(3))
    assert score.n_successes == score.trials_achieved == 0
    assert score.trials_all == 6 * 8


def test_void_tests_are_repeated_with_other_seeds_and_never_counted(learner):
    score = run_test(learner.agent, ToyStation(void_epochs=(24,)), make_test(0))
    assert (score.n_tests, score.n_successes, score.n_void) == (0, 0, 12)
    row = evaluation_row(make_test(0), score, None)
    assert row.success == 0.0
    assert row.trials_needed is None


def test_more_probable_than_not_is_predicted_allowed(learner):
    agent = make_toy_learner(0, PROTOCOL).agent
    agent.subgoal_selector.predict_allowed = lambda goal, state: (0.49, 0.5, 0.51, 1.0)[goal]
    predicted = learnt_graph(agent)
    assert [predicted(goal, (False,) * 4) for goal in range(4)] == [False, False, True, True]
    agent.subgoal_selector = object()
    assert learnt_graph(agent) is None


def test_workers_score_what_this_process_would_have_scored(learner):
    state = encode({"agent": learner.agent.state_dict()})
    with pool_of(station=NoStation(), n_workers=N_GOALS) as pool:
        pool.submit(TESTS, state, None)
        assert pool.n_outstanding == 1
        assert list(pool.collect(at_most=0)) == [expected(learner)]
        assert pool.n_outstanding == 0


def test_evaluations_come_back_in_the_order_they_were_asked_for(learner):
    untrained = make_toy_learner(2, PROTOCOL)
    graph = tuple((4, goal) for goal in range(N_GOALS))
    with pool_of(n_workers=1) as pool:
        for agent, with_graph in ((learner.agent, None), (untrained.agent, graph), (learner.agent, None)):
            pool.submit(TESTS, encode({"agent": agent.state_dict()}), with_graph)
        first, second, third = pool.collect(at_most=0)
    assert first == third == expected(learner)
    assert [row.n_successes for row in second] == [row.n_successes for row in expected(untrained)]
    assert [(row.graph_cases, row.graph_wrong) for row in second] == list(graph)


def test_what_may_stay_outstanding_is_not_waited_for(learner):
    state = encode({"agent": learner.agent.state_dict()})
    with pool_of() as pool:
        pool.submit(TESTS, state, None)
        pool.submit(TESTS, state, None)
        assert list(pool.collect(at_most=2)) == []
        assert len(list(pool.collect(at_most=1))) == 1
        assert pool.n_outstanding == 1


def test_a_worker_that_dies_at_work_is_reported_and_its_test_redone_here(learner):
    said = []
    with pool_of(n_workers=2, make_learner=make_deadly_learner, report=said.append) as pool:
        pool.submit(TESTS, encode({"agent": learner.agent.state_dict()}), None)
        assert list(pool.collect(at_most=0)) == [expected(learner)]
    assert said == ["an evaluation worker died (exit code -9); its work is redone"] * 2


def test_a_worker_that_cannot_start_is_reported(learner):
    said = []
    with pool_of(n_workers=1, make_learner=make_unable_learner, report=said.append) as pool:
        pool.submit(TESTS, encode({"agent": learner.agent.state_dict()}), None)
        assert list(pool.collect(at_most=0)) == [expected(learner)]
    assert said == ["an evaluation worker died (exit code 7); its work is redone"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_signal_to_the_group_harms_no_worker_from_its_first_instant_on(learner, number, capfd):
    said = []
    with open_pool(station=NoStation(), n_workers=1, report=said.append) as pool:
        worker = pool._workers[0]
        while not worker.is_ready and not said:
            os.kill(worker.process.pid, number)
            pool._receive(wait=False)
            worker.process.join(timeout=0.01)
        pool.submit(TESTS, encode({"agent": learner.agent.state_dict()}), None)
        while not pool._evaluations[0].is_done and not said:
            os.kill(worker.process.pid, number)
            pool._receive(wait=True)
        assert list(pool.collect(at_most=0)) == [expected(learner)]
    assert (said, worker.process.exitcode) == ([], -signal.SIGKILL)
    assert capfd.readouterr().err == ""


def test_starting_workers_leaves_this_process_hearing_stop_signals_as_before():
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    with open_pool(n_workers=1):
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before


def test_closing_a_pool_twice_is_harmless_and_leaves_no_process():
    pool = pool_of(make_learner=partial(make_toy_learner, 0, PROTOCOL), n_workers=1)
    process = pool._workers[0].process
    pool.close()
    pool.close()
    assert not process.is_alive()
