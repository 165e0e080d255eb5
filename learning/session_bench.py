"""The bench of sessions: writing and reading beside the bare mcap package, what a run weighs, how fast it is replayed.

Times of two things are taken by turns, and the middle one of their ratios is told; processor time where one process is
meant, for a machine that does other things besides stretches the wall's.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from mcap.reader import make_reader
from mcap.writer import Writer

from config.loader import resolve
from config.resolved import Resolved
from learning.assembly import RobotLearner
from learning.evaluation import GoalTest, learnt_graph, run_test
from learning.experts import ExpertSet
from learning.metrics import Allowed, graph_errors, reachable_states
from learning.offline import teach
from learning.recorded import RecordedDecisions
from learning.replaying import Replayed, replay_to_learning
from learning.seeds import reset_seed
from robot.bench import BenchReport, BenchResult, bench_report
from robot.bus.topics import ARM_STATE
from robot.messages import ArmMode, ArmState, GripState
from robot.oracle import rules_oracle
from robot.recording.bench_wire import frame_rows, tick_rows
from robot.recording.messages import Purpose
from robot.recording.recorder import Recorder
from robot.recording.recording import Recording
from robot.recording.session_file import SessionFile
from robot.recording.sink import Sink
from robot.recording.topics import LANES
from robot.rigs import load

__all__ = ["bench_session"]

N_MESSAGES, N_TURNS = 40_000, 5
N_TICKS, CAMERA_HZ = 10_000, 15.0
N_EPOCHS, N_EPOCHS_FULL = 8, 60
SHOWS = "sim_twin.demonstrator:record_demonstrations"
N_SHOWN, N_TESTS, LEAST = 20, 20, 0.9
EXPERTS_GOAL = 3
REPLAY_GOAL = 200.0
TICK_NS = 2_000_000


def bench_session(*, full: bool) -> BenchReport:
    """Measure; full records and replays a longer run, and teaches a learner by scripted demonstrations alone."""
    started_s = perf_counter()
    with TemporaryDirectory() as folder:
        rows = (
            _files(Path(folder))
            + _wire(Path(folder))
            + _run(Path(folder) / "run.mcap", N_EPOCHS_FULL if full else N_EPOCHS)
        )
        rows += _shown(Path(folder) / "shown.mcap") if full else []
    return bench_report("session", rows, seconds=perf_counter() - started_s)


# ------------------------------------------------------------------------------------------------ beside bare mcap


def _files(folder: Path) -> list[BenchResult]:
    """Write and read the same messages, by turns with the bare package."""
    states = [_state(n) for n in range(N_MESSAGES)]
    payloads = _payloads(states, folder)
    ours, bare, read_ours, read_bare = [], [], [], []
    for turn in range(N_TURNS):
        ours.append(_seconds(partial(_write_ours, folder / f"ours-{turn}.mcap", payloads)))
        bare.append(_seconds(partial(_write_bare, folder / f"bare-{turn}.mcap", payloads)))
        read_ours.append(_seconds(partial(_read_ours, folder / "ours-0.mcap")))
        read_bare.append(_seconds(partial(_read_bare, folder / "ours-0.mcap")))
    write_ratio = median(b / a for a, b in zip(ours, bare, strict=True))
    read_ratio = median(b / a for a, b in zip(read_ours, read_bare, strict=True))
    return [
        _rate("write_msgs_per_s", ours),
        _rate("bare_write_msgs_per_s", bare),
        BenchResult(name="write_ratio", value=write_ratio, unit="of bare mcap"),
        _rate("read_msgs_per_s", read_ours),
        _rate("bare_read_msgs_per_s", read_bare),
        BenchResult(name="read_ratio", value=read_ratio, unit="of bare mcap"),
    ]


def _wire(folder: Path) -> list[BenchResult]:
    """Record ticks as they come over a wire, and frames."""
    return tick_rows(folder, [_state(n) for n in range(N_TICKS)]) + frame_rows(rate_hz=CAMERA_HZ)


def _rate(name: str, seconds: list[float]) -> BenchResult:
    return BenchResult(name=name, value=N_MESSAGES / median(seconds), unit="1/s")


def _seconds(what: Callable[[], object]) -> float:
    begun_s = perf_counter()
    what()
    return perf_counter() - begun_s


def _state(n: int) -> ArmState:
    """Return a measurement whose numbers all change."""
    x = n * 1.000_37e-4
    q = (x, 1.1 + x, -x / 3, x * x, 0.3 - x, x / 7)
    return ArmState(
        stamp_ns=n * TICK_NS, q_rad=q, qd_rad_s=q, tcp_position_m=q[:3], tcp_quat=q[:4], tcp_speed_m_s=q[:3],
        tcp_force_n=q[3:], grip=GripState(opening_m=0.085, is_moving=False, has_object=False), digital_in=0,
        digital_out=3, mode=ArmMode.RUNNING,
    )  # fmt: skip


def _payloads(states: list[ArmState], folder: Path) -> list[bytes]:
    recorder = Recorder(Sink(folder / "unused.mcap", may_wait=True), lanes=LANES)
    payloads = [recorder.encoded(state) for state in states]
    recorder.close()
    return payloads


def _write_ours(path: Path, payloads: list[bytes]) -> None:
    recorder = Recorder(Sink(path, may_wait=True), lanes=LANES)
    for n, payload in enumerate(payloads):
        recorder.put(ARM_STATE, payload, log_ns=n * TICK_NS, stamp_ns=n * TICK_NS)
    recorder.close()


def _write_bare(path: Path, payloads: list[bytes]) -> None:
    with path.open("wb") as opened:
        writer = Writer(opened)
        writer.start()
        channel = writer.register_channel("arm/state", "json", writer.register_schema("s", "jsonschema", b"{}"))
        for n, payload in enumerate(payloads):
            writer.add_message(channel, n * TICK_NS, payload, n * TICK_NS, n)
        writer.finish()


def _read_ours(path: Path) -> None:
    with SessionFile(path) as session:
        assert sum(1 for _ in session.raw()) == N_MESSAGES


def _read_bare(path: Path) -> None:
    with path.open("rb") as opened:
        assert sum(1 for _ in make_reader(opened).iter_messages()) == N_MESSAGES


# ------------------------------------------------------------------------------------------------- a recorded run


def _run(path: Path, n_epochs: int) -> list[BenchResult]:
    """Learn for some epochs recorded, as many unrecorded, and replay."""
    resolved = resolve(rig="twin", scenario="paper", learning="default")
    bare_s, n_decisions, _ = _learn(resolved, None, n_epochs)
    recorded_s, _, arm_s = _learn(resolved, path, n_epochs)
    replayed, _ = replay_to_learning(path)
    size = path.stat().st_size
    return [
        BenchResult(name="bytes_per_hour", value=size / arm_s * 3600.0, unit="B/h of motion, twin at 100 Hz"),
        BenchResult(
            name="recorder_us_per_decision", value=1e6 * (recorded_s - bare_s) / n_decisions, unit="us of processor",
            details={"recorded": f"{recorded_s:.2f} s", "bare": f"{bare_s:.2f} s", "decisions": str(n_decisions)},
        ),
        BenchResult(
            name="recorder_share_of_real_time", value=(recorded_s - bare_s) / arm_s, unit="of a processor",
            details={"motion": f"{arm_s:.0f} s"},
        ),
        *_replay_rows(replayed),
    ]  # fmt: skip


def _shown(path: Path) -> list[BenchResult]:
    """Show every goal 20 times by a scripted person, teach a learner by that alone, and test it."""
    resolved = resolve(rig="twin", scenario="paper", learning="default")
    names = [goal.name for goal in resolved.scenario.goals]
    n_right = load(SHOWS)(path, resolved, n_each=N_SHOWN, seed=1)
    learner = RobotLearner(resolved, seed=0)
    agent, oracle = learner.agent, rules_oracle(resolved)
    experts = agent.experts
    assert isinstance(experts, ExpertSet), "build_agent makes one"
    taught = teach(agent, experts, learner.station.spec, [path], scenario=resolved.scenario.name)
    allowed: Allowed = lambda goal, state: oracle(goal, state, 0)  # noqa: E731
    predicted = learnt_graph(agent)
    assert predicted is not None, "the learner of this preset has a graph"
    wrong = sum(graph_errors(predicted, allowed, reachable_states(allowed, len(names)), len(names)))
    shares = [_tested(learner, goal) for goal in range(len(names))]
    learner.close()
    n_good = sum(share >= LEAST for share in shares)
    return [
        BenchResult(
            name="shown_experts_at_90", value=float(n_good), unit="experts", goal=f">= {EXPERTS_GOAL}",
            ok=n_good >= EXPERTS_GOAL,
            details={name: f"{share:.0%}" for name, share in zip(names, shares, strict=True)}
            | {"ways": " ".join(map(str, taught.ways_by_goal)), "went as they should": str(n_right)},
        ),
        BenchResult(name="shown_graph_wrong", value=float(wrong), unit="predictions", goal="0", ok=not wrong),
    ]  # fmt: skip


def _tested(learner: RobotLearner, goal: int) -> float:
    test = GoalTest(root_seed=99, epoch=0, rules_epoch=0, goal=goal, n_tests=N_TESTS, n_trials=8)
    return run_test(learner.agent, learner.station, test).n_successes / N_TESTS


def _replay_rows(replayed: Replayed) -> list[BenchResult]:
    over = replayed.recorded_s / replayed.processor_s
    return [
        BenchResult(
            name="replay_over_real_time", value=over, unit="x, by processor time", goal=f">= {REPLAY_GOAL:g}",
            ok=over >= REPLAY_GOAL,
            details={"motion": f"{replayed.recorded_s:.0f} s", "wall": f"{replayed.over_real_time:.0f}x"},
        ),
        BenchResult(
            name="replay_identical", value=float(replayed.is_identical), unit="yes is 1", goal="1",
            ok=replayed.is_identical, details={"fingerprints": str(replayed.n_compared)},
        ),
    ]  # fmt: skip


def _learn(resolved: Resolved, path: Path | None, n_epochs: int) -> tuple[float, int, float]:
    """Return processor time without start-up, decisions, and how long the arm's clock went, seconds."""
    recording = None
    if path is not None:
        recording = Recording(path, resolved, purpose=Purpose.LEARN, seed=0)
    learner = RobotLearner(resolved, seed=0, tap=None if recording is None else recording.ticks)
    agent, station, heard = learner.agent, learner.station, None
    if recording is not None:
        station = recording.station(station)
        agent.witness = heard = RecordedDecisions(recording, [goal.name for goal in resolved.scenario.goals])
    n_decisions, begun_s = 0, process_time()
    for epoch in range(n_epochs):
        record = agent.learn_epoch(station, epoch=epoch, seed=reset_seed(0, epoch), goal=agent.choose_goal())
        n_decisions += record.n_steps
    if recording is not None:
        recording.recorder.flush()
        if heard is not None:
            heard.captured(n_epochs, agent)
    spent_s, arm_s = process_time() - begun_s, learner.measured().stamp_ns / 1e9
    learner.close()
    if recording is not None:
        recording.close()
    return spent_s, n_decisions, arm_s
