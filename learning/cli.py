"""Commands of the learning room: learn, evaluate, explain, report. The edge: terminal, files and the host's clock."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, ParamSpec, TypeVar

import msgspec
import typer
from rich.console import Console
from rich.text import Text

from learning.consent import Consent
from learning.ended import Ended
from learning.errors import LearningError, RunFolderError
from learning.progress import Progress, Status
from learning.recording import RecordWanted
from learning.report import Run, load_run, load_runs
from learning.report_files import write_report
from learning.run_folder import RunFolder
from learning.stopwatch import Stopwatch
from learning.telling import explanation_table, not_known_yet, profile_table, report_tables, score_table, summary_lines
from learning.wanted import Wanted
from robot.stop_request import StopRequest

if TYPE_CHECKING:
    from learning.session import Session

__all__ = ["evaluate", "explain", "learn", "report"]

EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130
STOPPING = (
    "stopping after this epoch and the evaluations that are due or under way "
    "(once more: at once, losing what came after the last checkpoint)"
)

Record = Annotated[bool, typer.Option("--record", help="Record the session to one MCAP file, in the run's folder.")]
RecordTo = Annotated[Path | None, typer.Option(help="The same, to this file.")]
Person = Annotated[str, typer.Option(help="Who attends, as they want to be called in what is recorded.")]

P = ParamSpec("P")
R = TypeVar("R")


def _one_line_errors(command: Callable[P, R]) -> Callable[P, R]:
    """Turn errors raised on purpose into one line and an exit code."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except LearningError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(EXIT_USAGE if isinstance(error, RunFolderError) else EXIT_FAILED) from error

    return run


@_one_line_errors
def learn(
    scenario: Annotated[str | None, typer.Option(help="Shipped scenario or a file.  [default: paper]")] = None,
    rig: Annotated[str | None, typer.Option(help="Shipped rig or a file.  [default: twin]")] = None,
    preset: Annotated[str | None, typer.Option(help="Shipped learner or a file.  [default: default]")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Root seed of everything drawn.  [default: 0]")] = None,
    epochs: Annotated[int | None, typer.Option(min=1, help="Epochs, in place of the learner's own number.")] = None,
    out: Annotated[Path | None, typer.Option(help="Run folder.  [default: runs/SCENARIO-PRESET-SEED]")] = None,
    workers: Annotated[int | None, typer.Option(min=0, help="Evaluation processes beside this one.")] = None,
    record_to: RecordTo = None,
    person: Person = "unnamed",
    replay: Annotated[
        Path | None, typer.Option(help="No run: let the learner live through this session again, and compare.")
    ] = None,
    taught_by: Annotated[
        list[Path] | None, typer.Option("--from", help="Show this session to a new learner first; more than once.")
    ] = None,
    *,
    record: Record = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in the folder, if there is one.")
    ] = False,
    judged: Annotated[bool, typer.Option("--judged", help="Evaluate densely, 20 test epochs a goal.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the summary as one JSON object.")] = False,
) -> None:
    """Let the arm teach itself a scenario's goals; leave a run folder with metrics, checkpoints and figures.

    Ctrl-C stops at the end of the epoch in hand and of the evaluations due by then (exit code 130) and loses nothing;
    a second one stops at once. --resume goes on: in lock-step bit for bit, by the wall clock (rigs with an address)
    from the same learnt state.
    """
    if replay is not None:
        _replay(replay, json=json)
        return
    from learning.session import open_session  # brings torch, seconds that reports do not need

    wanted = Wanted(scenario=scenario, rig=rig, preset=preset, seed=seed, epochs=epochs, judged=judged)
    folder = RunFolder(out or _default_folder(wanted))
    console = Console(stderr=True)
    stopwatch = Stopwatch(perf_counter)
    recorded = RecordWanted.of(record_to, is_asked=record, person=person, tell=_tell_loss)
    with folder:
        consent = Consent(folder, workers=workers)
        session = open_session(
            folder, wanted, resume=resume, stopwatch=stopwatch, consent=consent, record=recorded,
            taught_by=taught_by or (),
        )  # fmt: skip
        try:
            ended = _run(session, folder, console, consent.n_workers)
        finally:
            session.close()
        run = load_run(folder)
        folder.write_json("summary.json", run.summary)
        write_report([run], folder.figures)
    if json:
        typer.echo(msgspec.json.encode(run.summary).decode())
    else:
        _tell(run, ended)


def _replay(path: Path, *, json: bool) -> None:
    """Replay a session into the learner; exit code 1 where it does not come to the same."""
    from learning.replaying import replay_to_learning  # brings torch

    with Status("replaying", now_s=perf_counter) as status:
        replayed, _ = replay_to_learning(path, tell=lambda n_done: status(f"replayed up to epoch {n_done}"))
    if json:
        typer.echo(msgspec.json.encode(replayed.told()).decode())
    else:
        for line in replayed.lines():
            typer.echo(line)
    if not replayed.is_identical:
        raise typer.Exit(EXIT_FAILED)


def _tell_loss(why: str) -> None:
    typer.echo(f"recording: {why}", err=True)


def _run(session: "Session", folder: RunFolder, console: Console, n_workers: int) -> Ended:
    """Run to the end; when stopped before, say how to go on and leave with the exit code of an interrupt."""
    manifest = session.manifest
    goals = [goal.name for goal in manifest.goals]
    progress = Progress(
        goals=goals, n_epochs=manifest.n_epochs, n_done=session.n_done, now_s=perf_counter, console=console
    )
    how_to_go_on = f"go on with: autotelic learn --resume --out {folder.path}"
    try:
        with progress, StopRequest(lambda: progress.say(STOPPING)) as stop:
            for remark in session.remarks:
                progress.say(remark)
            ended = session.run(progress, n_workers=n_workers, should_stop=stop)
    except KeyboardInterrupt:
        typer.echo(f"stopped at once; {how_to_go_on}", err=True)
        raise typer.Exit(EXIT_INTERRUPTED) from None
    if not ended.is_finished:
        typer.echo(f"stopped after epoch {ended.n_done} of {ended.n_epochs}; {how_to_go_on}", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)
    return ended


@_one_line_errors
def evaluate(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    tests: Annotated[int, typer.Option(min=1, help="Test epochs a goal.")] = 20,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of the layouts.  [default: the run's]")] = None,
    rules_epoch: Annotated[
        int | None, typer.Option(min=0, help="Epoch whose rules are in force.  [default: the last one learnt]")
    ] = None,
    rig: Annotated[str | None, typer.Option(help="Shipped rig or a file to test on.  [default: the run's]")] = None,
    record_to: RecordTo = None,
    person: Person = "unnamed",
    *,
    record: Record = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Test what a run's newest checkpoint holds: learning off, fresh table layouts, every goal."""
    from learning.assess import assess  # brings torch, seconds that reports do not need

    folder = RunFolder(run)
    goals = [goal.name for goal in folder.manifest().goals]
    with Status(f"testing {len(goals)} goals, {tests} epochs each", now_s=perf_counter) as status:
        assessed = assess(
            folder, n_tests=tests, seed=seed, rules_epoch=rules_epoch, rig=rig, tell=status,
            record=RecordWanted.of(record_to, is_asked=record, person=person, tell=_tell_loss),
        )  # fmt: skip
    rows, stops = assessed.rows, assessed.stops
    if json:
        typer.echo(msgspec.json.encode({"goals": goals, "rows": rows, "stops": stops.as_tree()}).decode())
    else:
        Console().print(score_table(rows, goals))
        typer.echo(stops.line())


@_one_line_errors
def explain(
    run: Annotated[Path, typer.Argument(help="Run folder.")],
    *,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Tell what a run's newest checkpoint believes each goal needs, on what evidence, and the plan that follows."""
    from learning.assess import beliefs_of  # brings torch, seconds that reports do not need

    folder = RunFolder(run)
    infos = folder.manifest().goals
    goals = [goal.name for goal in infos]
    explanations = beliefs_of(folder)
    unknown = not_known_yet(explanations, infos)
    if json:
        told = {
            "goals": goals,
            "explanations": explanations,
            "not_known_yet": list(range(len(explanations), len(goals))),
        }
        typer.echo(msgspec.json.encode(told).decode())
        return
    Console().print(explanation_table(explanations, goals))
    for line in unknown:
        typer.echo(line)


@_one_line_errors
def report(
    runs: Annotated[list[Path], typer.Argument(help="Run folders, or folders of run folders.")],
    out: Annotated[Path | None, typer.Option(help="Where to write.  [default: the run's figures, else report]")] = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print the figures of merit as one JSON object.")] = False,
) -> None:
    """Draw both panels of the paper's Figure 2 and the curriculum; runs of one learner become median and range.

    Runs inside a folder that cannot be read are named and left out (exit code 1); so are folders of something else that
    hold a file like a run's, and are no fault.
    """
    loaded = load_runs(runs)
    for line in loaded.lines():
        typer.echo(line, err=True)
    if loaded.runs:
        _report(loaded.runs, out or _report_folder(loaded.runs, is_whole=not loaded.left_out), json=json)
    if loaded.left_out:
        raise typer.Exit(EXIT_FAILED)


def _report_folder(runs: Sequence[Run], *, is_whole: bool) -> Path:
    """Return where a report goes that was given no place: into the run where one run was asked for."""
    return RunFolder(Path(runs[0].folder)).figures if is_whole and len(runs) == 1 else Path("report")


def _report(runs: Sequence[Run], folder: Path, *, json: bool) -> None:
    told, paths = write_report(runs, folder)
    if json:
        typer.echo(msgspec.json.encode(told).decode())
        return
    Console().print(*report_tables(told))
    for path, stops in told.stops:
        typer.echo(f"{path}: {stops.line()}")
    for path in paths:
        typer.echo(path)


def _tell(run: Run, ended: Ended) -> None:
    console = Console()
    for line in summary_lines(run):
        console.print(Text(line), soft_wrap=True)
    console.print(profile_table(ended.spent))
    console.print(Text(f"figures in {RunFolder(Path(run.folder)).figures}"), soft_wrap=True)


def _default_folder(wanted: Wanted) -> Path:
    parts = (Path(wanted.scenario or "paper").stem, Path(wanted.preset or "default").stem, str(wanted.seed or 0))
    return Path("runs") / "-".join(parts)
