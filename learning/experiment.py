"""The experiment: epoch after epoch, with evaluations and checkpoints between them.

A run is a function of its config and its root seed. It may be stopped, or killed, at any instant; going on from its
newest checkpoint gives the files that an uninterrupted run would have given.
"""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import msgspec

from config.learning import Experiment as ExperimentConfig
from learning.agent import Agent, EpochRecord
from learning.checkpoint import CheckpointStore, encode, taking_up
from learning.errors import TooManyVoidEpochsError
from learning.evaluation import GoalTest, learnt_graph
from learning.evaluation_pool import EvaluationPool
from learning.interfaces import GoalState
from learning.metrics import Allowed, due_evaluations, due_graph_looks, graph_errors, reachable_states
from learning.rows import EvaluationRow, GraphRow, goal_row, trial_rows
from learning.seeds import reset_seed
from learning.stopwatch import Stopwatch
from learning.tables import TABLES, Tables
from robot.station import Station

__all__ = ["Experiment", "Oracle", "Plan", "Watcher"]

Oracle = Callable[[int, GoalState, int], bool]
"""Whether the rules in force in an epoch let a goal come about in a goal-state: (goal, state, epoch). Judges only."""

BACKLOG = 2
"""Evaluations that may be outstanding while the learning goes on."""


class Watcher(Protocol):
    """Is told how the run goes."""

    def epoch_begins(self, epoch: int, goal: int) -> None:
        """A goal was chosen."""
        ...

    def epoch_ended(self, record: EpochRecord) -> None:
        """An epoch is over."""
        ...

    def evaluated(self, rows: Sequence[EvaluationRow]) -> None:
        """An evaluation is done."""
        ...

    def goals_met(self, epoch: int, goals: Sequence[int]) -> None:
        """Goals became known."""
        ...


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """What is to be run."""

    seed: int
    protocol: ExperimentConfig
    changes: tuple[int, ...]
    """Epochs at which the rules change; known here to time evaluations, never told to the agent."""
    arrivals: tuple[int, ...] = ()
    """Epochs at which goals become known; the agent meets them."""


class _Due(msgspec.Struct, frozen=True, kw_only=True):
    """A checkpoint that waits for evaluations of its epoch or before to be written."""

    epoch: int
    state: bytes
    n_evaluation_rows: int


class Experiment:
    """Runs a plan, or the rest of it."""

    def __init__(
        self,
        *,
        plan: Plan,
        agent: Agent,
        station: Station,
        pool: EvaluationPool,
        tables: Tables,
        store: CheckpointStore,
        watcher: Watcher,
        oracle: Oracle | None = None,
        stopwatch: Stopwatch | None = None,
        when_kept: Callable[[], None] = lambda: None,
        when_captured: Callable[[int, Agent], None] = lambda _n_done, _agent: None,
    ) -> None:
        self._plan = plan
        self._agent = agent
        self._station = station
        self._pool = pool
        self._tables = tables
        self._store = store
        self._watcher = watcher
        self._oracle = oracle
        self._stopwatch = stopwatch or Stopwatch()
        self._when_kept = when_kept
        self._when_captured = when_captured
        self._cases: dict[tuple[int, int], list[GoalState]] = {}
        self._waiting: deque[_Due] = deque()
        self._n_evaluation_rows = tables.n_rows("evaluations")
        """Rows written or on their way."""
        self._n_done = self._n_done_before = 0
        self._n_void_running = 0

    def restore(self, state: dict[str, Any]) -> None:
        """Take up the run where a checkpoint left it; the tables must have been cut back to its row counts.

        Raises:
            CheckpointError: the checkpoint is another version's.
        """
        with taking_up():
            self._agent.load_state_dict(state["agent"])
            self._n_done = self._n_done_before = state["n_done"]
            self._n_void_running = state["n_void_running"]

    def run(self, should_stop: Callable[[], bool] = lambda: False) -> int:
        """Learn until the plan is carried out or a stop is asked for, and return how many epochs are done.

        A stop takes effect at the end of the epoch in hand; evaluations due by then are finished and the state is kept.

        Raises:
            TooManyVoidEpochsError: epoch after epoch was cut short.
        """
        if self._n_done == 0:
            self._checkpoint()
        while self._n_done < self._plan.protocol.epochs and not should_stop():
            self._run_epoch()
            self._look_at_graph_if_due()
            self._evaluate_if_due()
            if self._n_done in self._plan.changes:
                self._keep_milestone()
            is_last = self._n_done == self._plan.protocol.epochs
            if self._n_done % self._plan.protocol.checkpoint_every == 0 and not is_last:
                self._checkpoint()
            self._settle(at_most=BACKLOG)
        self._checkpoint()
        self._settle(at_most=0)
        return self._n_done

    # ------------------------------------------------------------------------------------------------------ learning

    def _run_epoch(self) -> None:
        epoch = self._n_done
        met = self._agent.meet_goals(epoch)
        if met:
            self._watcher.goals_met(epoch, met)
        goal = self._agent.choose_goal()
        self._watcher.epoch_begins(epoch, goal)
        seed = reset_seed(self._plan.seed, epoch)
        record = self._agent.learn_epoch(self._station, epoch=epoch, seed=seed, goal=goal)
        self._tables.append("trials", trial_rows(record))
        self._tables.append("goals", [goal_row(record)])
        self._tables.flush()
        self._n_done += 1
        self._watcher.epoch_ended(record)
        self._stopwatch.lap("records")
        self._n_void_running = self._n_void_running + 1 if record.is_void else 0
        if self._n_void_running >= self._plan.protocol.void_limit:
            message = (
                f"{self._n_void_running} epochs running were cut short, the last one epoch {epoch}: expected a plant "
                f"that stays engaged, got {self._station.state.mode} {self._station.state.reason}".rstrip()
            )
            raise TooManyVoidEpochsError(message)

    # ---------------------------------------------------------------------------------------------------- evaluation

    def _evaluate_if_due(self) -> None:
        protocol = self._plan.protocol
        due = due_evaluations(
            self._n_done,
            every=protocol.evaluate_every,
            dense_every=protocol.dense_every,
            dense_for=protocol.dense_for,
            changes=self._plan.changes,
            n_epochs=protocol.epochs,
            arrivals=self._plan.arrivals,
        )
        if not due:
            return
        state = encode({"agent": self._agent.state_dict()})
        for rules_epoch in due:
            tests = [self._test_of(goal, rules_epoch) for goal in range(self._agent.n_goals)]
            self._pool.submit(tests, state, self._compare_graph(rules_epoch))
            self._n_evaluation_rows += len(tests)
        self._stopwatch.lap("evaluation")

    def _test_of(self, goal: int, rules_epoch: int) -> GoalTest:
        return GoalTest(
            root_seed=self._plan.seed,
            epoch=self._n_done,
            rules_epoch=rules_epoch,
            goal=goal,
            n_tests=self._plan.protocol.test_epochs,
            n_trials=self._plan.protocol.trials,
        )

    def _look_at_graph_if_due(self) -> None:
        protocol = self._plan.protocol
        due = due_graph_looks(
            self._n_done, every=protocol.dense_every, changes=self._plan.changes, n_epochs=protocol.epochs
        )
        for rules_epoch in due:
            compared = self._compare_graph(rules_epoch)
            if compared is None:
                return
            n_cases, n_wrong = (sum(column) for column in zip(*compared, strict=True))
            row = GraphRow(epoch=self._n_done, rules_epoch=rules_epoch, n_cases=n_cases, n_wrong=n_wrong)
            self._tables.append("graphs", [row])
        self._stopwatch.lap("records")

    def _compare_graph(self, rules_epoch: int) -> tuple[tuple[int, int], ...] | None:
        """Compare what the agent believes possible with the rules, in every goal-state that can be reached."""
        predicted, oracle, n_goals = learnt_graph(self._agent), self._oracle, self._agent.n_goals
        if predicted is None or oracle is None:
            return None
        allowed: Allowed = lambda goal, state: oracle(goal, state, rules_epoch)  # noqa: E731
        era = max(change for change in (0, *self._plan.changes) if change <= rules_epoch)
        if (era, n_goals) not in self._cases:
            self._cases[era, n_goals] = reachable_states(allowed, n_goals)
        states = self._cases[era, n_goals]
        return tuple((len(states), wrong) for wrong in graph_errors(predicted, allowed, states, n_goals))

    # --------------------------------------------------------------------------------------------------- checkpoints

    def _checkpoint(self) -> None:
        """Capture the state of this epoch boundary; it is kept as soon as the evaluations up to here are written."""
        n_rows = {name: self._tables.n_rows(name) for name in TABLES} | {"evaluations": self._n_evaluation_rows}
        state = {
            "n_done": self._n_done,
            "n_void_running": self._n_void_running,
            "n_rows": n_rows,
            "agent": self._agent.state_dict(),
        }
        self._when_captured(self._n_done, self._agent)
        captured = _Due(epoch=self._n_done, state=encode(state), n_evaluation_rows=self._n_evaluation_rows)
        self._waiting.append(captured)
        self._keep_checkpoints()
        self._stopwatch.lap("checkpoints")

    def _keep_milestone(self) -> None:
        """Keep what is learnt before the rules change for good, so that what followed can be looked at again."""
        self._store.keep(self._n_done, encode({"n_done": self._n_done, "agent": self._agent.state_dict()}))
        self._stopwatch.lap("checkpoints")

    def _settle(self, *, at_most: int) -> None:
        """Write finished evaluations and the checkpoints that waited for them."""
        with self._stopwatch.all_booked_to("evaluation"):
            for rows in self._pool.collect(at_most=at_most):
                self._tables.append("evaluations", rows)
                self._tables.flush()
                self._watcher.evaluated(rows)
                self._keep_checkpoints()

    def _keep_checkpoints(self) -> None:
        while self._waiting and self._waiting[0].n_evaluation_rows <= self._tables.n_rows("evaluations"):
            captured = self._waiting.popleft()
            self._tables.sync()
            self._store.save(captured.epoch, captured.state)
            if self._n_done > self._n_done_before:
                self._when_kept()
