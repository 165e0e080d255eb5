"""A test of what a run's newest checkpoint holds, apart from the run itself."""

from collections.abc import Callable, Sequence

import msgspec

from config.loader import with_rig
from config.resolved import Resolved
from learning.agent import Agent
from learning.assembly import RobotLearner
from learning.checkpoint import taking_up
from learning.errors import LearningError
from learning.evaluation import GoalTest, evaluation_row, learnt_graph, run_test
from learning.explain import Explanation, explain_graph
from learning.graph import Graph
from learning.metrics import Allowed, graph_errors, reachable_states
from learning.recorded import RecordedDecisions
from learning.recording import RecordWanted, open_recording
from learning.rows import EvaluationRow
from learning.run_folder import Manifest, RunFolder
from learning.stops import Stops
from robot.oracle import rules_oracle
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.station import Station

__all__ = ["Assessed", "assess", "beliefs_of"]


def beliefs_of(folder: RunFolder) -> tuple[Explanation, ...]:
    """Return what a run's newest checkpoint believes each goal needs.

    Raises:
        RunFolderError: this is no run folder.
        CheckpointError: no checkpoint can be read, or the newest is another version's.
        LearningError: the run's sub-goal selector holds no graph.
    """
    manifest, config = folder.manifest(), folder.config().learning.subgoal_selection
    if config.kind != "graph":
        raise LearningError(f"{folder.path}: expected a run whose sub-goal selector is graph, it is {config.kind}")
    state, _ = folder.checkpoints.newest()
    graph = Graph(n_goals=len(manifest.goals), config=config)
    with taking_up():
        graph.load_state_dict(state["agent"]["subgoal_selector"]["graph"])
    return explain_graph(graph)


class Assessed(msgspec.Struct, frozen=True, kw_only=True):
    """What a test came to."""

    rows: tuple[EvaluationRow, ...]
    """One a goal."""
    stops: Stops
    """What stopped the arm meanwhile."""


def assess(
    folder: RunFolder,
    *,
    n_tests: int,
    seed: int | None,
    rules_epoch: int | None,
    rig: str | None = None,
    tell: Callable[[str], object] = lambda _: None,
    record: RecordWanted | None = None,
    goals: Sequence[int] | None = None,
    when_tested: Callable[[EvaluationRow], object] = lambda _: None,
) -> Assessed:
    """Return a row a goal: learning off, the newest checkpoint, from fresh table layouts.

    Args:
        folder: a run's folder; it is only read.
        n_tests: test epochs a goal.
        seed: root seed of the layouts; None takes the run's own, which gives what the run's own evaluation gave.
        rules_epoch: epoch whose rules are in force; None takes the last one learnt.
        rig: shipped rig or a file to test on; None takes the run's own.
        tell: told after every test epoch how far it is, in words.
        record: where it is recorded; None records nothing.
        goals: which goals to test; None tests all.
        when_tested: hears each goal's row as soon as it is there.

    Raises:
        ConfigError: the rig's file is missing or wrong, or it is another arm's.
        RunFolderError: this is no run folder.
        CheckpointError: no checkpoint can be read, or the newest is another version's.
    """
    manifest, resolved = folder.manifest(), folder.config()
    if rig is not None:
        resolved = with_rig(resolved, rig)
    state, _ = folder.checkpoints.newest()
    epoch = max(0, state["n_done"] - 1) if rules_epoch is None else rules_epoch
    n_goals, oracle = state["agent"].get("n_goals", len(manifest.goals)), rules_oracle(resolved)
    tests = [
        GoalTest(
            root_seed=manifest.seed if seed is None else seed,
            epoch=state["n_done"],
            rules_epoch=epoch,
            goal=goal,
            n_tests=n_tests,
            n_trials=manifest.n_trials,
        )
        for goal in (range(n_goals) if goals is None else goals)
    ]
    recording = None
    if record is not None:
        recording = open_recording(
            record, folder, resolved, seed=tests[0].root_seed, state=state, purpose=Purpose.TEST
        )  # fmt: skip
    learner, station = _recorded_learner(resolved, manifest, recording)
    try:
        with taking_up():
            learner.agent.load_state_dict(state["agent"])
        graph = _graph(learner.agent, lambda goal, latched: oracle(goal, latched, epoch), n_goals)
        rows = []
        for test in tests:
            heard = _Count(f"{manifest.goals[test.goal].name}, goal {test.goal + 1} of {n_goals}", tell)
            score = run_test(learner.agent, station, test, when_tested=heard)
            rows.append(evaluation_row(test, score, graph[test.goal]))
            when_tested(rows[-1])
    finally:
        stops = learner.stops
        learner.close()
        if recording is not None:
            recording.close()
    return Assessed(rows=tuple(rows), stops=stops)


def _graph(agent: Agent, allowed: Allowed, n_goals: int) -> list[tuple[int, int] | None]:
    """Return for each goal in how many goal-states what was learnt was compared with the rules, and was wrong."""
    predicted = learnt_graph(agent)
    if predicted is None:
        return [None] * n_goals
    states = reachable_states(allowed, n_goals)
    return [(len(states), n_wrong) for n_wrong in graph_errors(predicted, allowed, states, n_goals)]


def _recorded_learner(
    resolved: Resolved, manifest: Manifest, recording: Recording | None
) -> tuple[RobotLearner, Station]:
    """Return a learner and the station that it is tested on, recorded where that is wanted."""
    tap = None if recording is None else recording.ticks
    learner = RobotLearner(resolved, seed=manifest.seed, tap=tap)
    if recording is None:
        return learner, learner.station
    learner.agent.witness = RecordedDecisions(recording, [goal.name for goal in manifest.goals])
    return learner, recording.station(learner.station, measure=learner.measured, ticks=learner.ticks)


class _Count:
    """Tells how many test epochs of a goal were run."""

    def __init__(self, goal: str, tell: Callable[[str], object]) -> None:
        self._goal, self._tell, self._n = goal, tell, 0

    def __call__(self) -> None:
        self._n += 1
        self._tell(f"{self._goal}: {self._n} test epochs run")
