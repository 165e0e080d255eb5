"""Evaluations beside the learning: worker processes, results in order, the same whatever the number of workers.

What was learnt travels as checkpoint bytes to processes that have a learner and a station of their own. The learning
process lends a hand when too much is waiting, and redoes what a dead worker left behind.
"""

import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import connection, get_context, resource_tracker
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import Self

import msgspec

from learning.agent import Agent
from learning.checkpoint import decode
from learning.evaluation import GoalScore, GoalTest, Learner, evaluation_row, run_test
from learning.rows import EvaluationRow
from robot.station import Station

__all__ = ["EvaluationPool", "MakeLearner"]

MakeLearner = Callable[[], Learner]
"""Makes a fresh learner; importable by name, so that a new process can call it too."""

Graph = tuple[tuple[int, int], ...] | None
"""For each goal: goal-states compared and how many of them predicted wrongly."""

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""What reaches every process of the group; the learning process alone decides what it means."""

PATIENCE_S = 5.0
"""How long a worker whose pipe has closed may take to exit by itself."""


class _Task(msgspec.Struct, frozen=True, kw_only=True):
    """What is sent to a worker. State comes along only if the worker does not hold it yet."""

    test: GoalTest
    state: bytes | None


class _Evaluation:
    """One evaluation under way: its goals' tests and the scores that have come in."""

    def __init__(self, tests: Sequence[GoalTest], state: bytes, graph: Graph) -> None:
        self.tests = tests
        self.state = state
        self.waiting = deque(tests)
        self.scores: dict[int, GoalScore] = {}
        self._graph = graph

    @property
    def is_done(self) -> bool:
        return len(self.scores) == len(self.tests)

    def rows(self) -> list[EvaluationRow]:
        return [evaluation_row(test, self.scores[test.goal], self._graph_of(test.goal)) for test in self.tests]

    def _graph_of(self, goal: int) -> tuple[int, int] | None:
        return None if self._graph is None else self._graph[goal]


class _Worker:
    """One process and the pipe to it."""

    def __init__(self, make_learner: MakeLearner) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(theirs, make_learner), daemon=True)
        self.process.start()
        theirs.close()
        self.is_ready = False
        """Has said that its learner stands; before that a large state would block the sender for seconds."""
        self.holds: _Evaluation | None = None
        """The evaluation whose state it has."""
        self.busy_with: tuple[_Evaluation, GoalTest] | None = None

    def give(self, evaluation: _Evaluation, test: GoalTest) -> None:
        state = None if self.holds is evaluation else evaluation.state
        self.busy_with, self.holds = (evaluation, test), evaluation
        self.pipe.send_bytes(msgspec.msgpack.encode(_Task(test=test, state=state)))

    def stop(self) -> None:
        self.pipe.close()
        self.process.kill()  # it is deaf to SIGTERM, and nothing of a worker's is kept
        self.process.join()


class EvaluationPool:
    """Hands tests to idle workers and gives finished evaluations back in the order in which they were asked for."""

    def __init__(
        self,
        *,
        tester: Agent,
        station: Station,
        make_learner: MakeLearner | None = None,
        n_workers: int = 0,
        report: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start the workers.

        Args:
            tester: an agent of this process to test with, never the one that learns.
            station: where this process tests.
            make_learner: makes a worker's own agent and station.
            n_workers: processes beside this one.
            report: is told in words of a worker's death.
        """
        self._tester = tester
        self._station = station
        self._tester_holds: _Evaluation | None = None
        self._workers: list[_Worker] = []
        self._report = report
        self._evaluations: deque[_Evaluation] = deque()
        if make_learner is not None:
            self._start(make_learner, n_workers)

    @property
    def n_outstanding(self) -> int:
        """Evaluations asked for and not given back yet."""
        return len(self._evaluations)

    def wait_until_ready(self) -> None:
        """Wait until every worker's learner stands, or the worker is dead."""
        while any(not worker.is_ready for worker in self._workers):
            self._receive(wait=True)

    def submit(self, tests: Sequence[GoalTest], state: bytes, graph: Graph) -> None:
        """Ask for an evaluation: the tests of all goals, of the agent whose checkpoint bytes are given."""
        self._evaluations.append(_Evaluation(tests, state, graph))
        self._receive(wait=False)

    def collect(self, *, at_most: int) -> Iterator[list[EvaluationRow]]:
        """Yield the rows of finished evaluations, in order, until at most so many are left outstanding.

        What is finished already is given back in any case; beyond that this process works itself or waits.
        """
        self._receive(wait=False)
        while self._evaluations:
            if self._evaluations[0].is_done:
                yield self._evaluations.popleft().rows()
            elif len(self._evaluations) <= at_most:
                return
            else:
                self._get_on()

    def close(self) -> None:
        """Stop the workers. Idempotent."""
        while self._workers:
            self._workers.pop().stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    # -------------------------------------------------------------------------------------------------------- inside

    def _start(self, make_learner: MakeLearner, n_workers: int) -> None:
        """Start the workers, all or, where a signal ends this process meanwhile, none."""
        try:
            with _stop_signals_held_back():
                self._workers.extend(_Worker(make_learner) for _ in range(n_workers))
        except BaseException:
            self.close()
            raise

    def _get_on(self) -> None:
        """Do one test here, or, where all are handed out, wait for a worker."""
        evaluation = next((entry for entry in self._evaluations if entry.waiting), None)
        if evaluation is None:
            self._receive(wait=True)
            return
        test = evaluation.waiting.popleft()
        if self._tester_holds is not evaluation:
            self._tester.load_state_dict(decode(evaluation.state)["agent"])
            self._tester_holds = evaluation
        evaluation.scores[test.goal] = run_test(self._tester, self._station, test)
        self._receive(wait=False)

    def _hand_out(self) -> None:
        """Give every idle worker the oldest test that waits."""
        for worker in list(self._workers):
            if not worker.is_ready or worker.busy_with is not None:
                continue
            evaluation = next((entry for entry in self._evaluations if entry.waiting), None)
            if evaluation is None:
                return
            try:
                worker.give(evaluation, evaluation.waiting.popleft())
            except OSError:
                self._bury(worker)

    def _receive(self, *, wait: bool) -> None:
        """Take in what workers have finished, and hand out more."""
        busy = [worker for worker in self._workers if worker.busy_with or not worker.is_ready]
        heard = connection.wait([worker.pipe for worker in busy], timeout=None if wait else 0.0) if busy else []
        for worker in busy:
            if worker.pipe in heard:
                self._hear(worker)
        self._hand_out()

    def _hear(self, worker: _Worker) -> None:
        """Take in a worker's word: its score, or at first that it is ready."""
        try:
            said = worker.pipe.recv_bytes()
        except (EOFError, OSError):
            self._bury(worker)
            return
        if worker.busy_with is None:
            worker.is_ready = True
            return
        evaluation, test = worker.busy_with
        evaluation.scores[test.goal] = msgspec.msgpack.decode(said, type=GoalScore)
        worker.busy_with = None

    def _bury(self, worker: _Worker) -> None:
        """Take a dead worker off the list and its test back; this process or another worker redoes it."""
        if worker.busy_with is not None:
            evaluation, test = worker.busy_with
            evaluation.waiting.appendleft(test)
        self._workers.remove(worker)
        worker.process.join(timeout=PATIENCE_S)
        worker.stop()
        self._report(f"an evaluation worker died (exit code {worker.process.exitcode}); its work is redone")


@contextmanager
def _stop_signals_held_back() -> Iterator[None]:
    """Let stop signals wait, here and in processes started meanwhile: those take seconds until they can ignore them.

    The resource tracker of multiprocessing is started first, as starting it unblocks these signals.
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: connection.Connection, make_learner: MakeLearner) -> None:
    """Run a worker: test what comes through the pipe until the other end closes."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    learner = make_learner()
    try:
        pipe.send_bytes(b"ready")
        while True:
            task = msgspec.msgpack.decode(pipe.recv_bytes(), type=_Task)
            if task.state is not None:
                learner.agent.load_state_dict(decode(task.state)["agent"])
            pipe.send_bytes(msgspec.msgpack.encode(run_test(learner.agent, learner.station, task.test)))
    except (EOFError, BrokenPipeError):
        pass
    finally:
        learner.close()
