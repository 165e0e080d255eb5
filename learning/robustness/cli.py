"""`autotelic robustness RUN`: what a run bears that was learnt on the twin. The edge: terminal, files, host clock."""

from pathlib import Path
from time import perf_counter, sleep
from typing import Annotated

import msgspec
import typer
from rich.console import Console

from config.errors import ConfigError
from learning.checkpoint import write_atomically
from learning.errors import LearningError, RunFolderError
from learning.figure_style import save
from learning.progress import Progress
from learning.robustness.cases import CASES, Case, case_named
from learning.robustness.cell import n_steps_done, read_result, run_case
from learning.robustness.figure import robustness_figure
from learning.robustness.fork import learnt_state
from learning.robustness.result import Plan, Robustness, bearing_of
from learning.robustness.telling import robustness_table
from learning.run_folder import RunFolder
from learning.sweeping.choosing import checked_place, make_executor
from learning.sweeping.executor import Executor, Job
from learning.sweeping.retrying import JobRunner
from robot.stop_request import StopRequest

__all__ = ["robustness"]

EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130
PLAN_NAME, RESULT_NAME, FIGURE_NAME = "plan.json", "robustness.json", "robustness"
LOOK_S = 0.2
TRIES = 3
CELL_MEMORY_MB = 2000


def robustness(
    run: Annotated[Path, typer.Argument(help="Folder of a run that learnt on a twin.")],
    out: Annotated[Path | None, typer.Option(help="Where to keep it.  [default: `robustness` in the run]")] = None,
    tests: Annotated[int, typer.Option(min=1, help="Test epochs a goal and case.")] = 20,
    epochs: Annotated[int, typer.Option(min=0, help="Epochs to go on learning for under each case.")] = 100,
    seed: Annotated[int | None, typer.Option(min=0, help="Root seed of the layouts.  [default: the run's]")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Cases at a time.  [default: one a processor]")] = None,
    on: Annotated[str, typer.Option(help="Who runs cases: `here`, `ray` or `ray:ADDRESS`.")] = "here",
    only: Annotated[str | None, typer.Option(help="Carry out this case alone, in this very process.")] = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Try a run's newest checkpoint on twins that are not the one it learnt on, and let it go on learning there.

    Lag, masses and friction 20 % more and less, a longer arm, percepts a centimetre off, worse experts: success by goal
    with its interval, before and after, and whether the learnt graph stays right. The run's folder is only read.
    Ctrl-C loses nothing (exit code 130), and whatever ended it, the same command goes on.
    """
    try:
        case = None if only is None else case_named(only)
        place, source = checked_place(on), RunFolder(run)
        plan = _plan_of(source, n_tests=tests, n_more=epochs, seed=seed)
        folder = (out or run / "robustness").absolute()
        if case is not None:
            _take_folder(folder, plan)
            _carry_out(source, plan, case, folder / case.name)
            return
        with RunFolder(folder):
            _take_folder(folder, plan)
            executor = make_executor(place, jobs, folder / "logs")
            runner = _run([_CaseTask(run.absolute(), plan, case, folder) for case in CASES], executor)
        _end(runner, source, plan, folder, json=json)
    except (ConfigError, LearningError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_USAGE if isinstance(error, ConfigError | RunFolderError) else EXIT_FAILED) from error


def _plan_of(run: RunFolder, *, n_tests: int, n_more: int, seed: int | None) -> Plan:
    manifest, state = run.manifest(), learnt_state(run)
    return Plan(
        learner=manifest.learner, scenario=manifest.scenario, run_seed=manifest.seed,
        config_sha256=manifest.config_sha256, n_done=state["n_done"], n_tests=n_tests, n_more=n_more,
        seed=manifest.seed if seed is None else seed,
    )  # fmt: skip


def _take_folder(folder: Path, plan: Plan) -> None:
    """Begin in a folder, or check that what was begun in it is the same.

    Raises:
        RunFolderError: it holds something else.
    """
    path = folder / PLAN_NAME
    try:
        begun = msgspec.json.decode(path.read_bytes(), type=Plan)
    except FileNotFoundError:
        folder.mkdir(parents=True, exist_ok=True)
        foreign = sorted(e.name for e in folder.iterdir() if e.name != "lock" and e.suffix != ".tmp")
        if foreign:
            raise RunFolderError(f"{folder}: expected an empty or new folder, found {foreign[0]} in it") from None
        write_atomically(path, msgspec.json.format(msgspec.json.encode(plan), indent=2) + b"\n")
        return
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RunFolderError(
            f"{path}: expected what was begun here, got {error}: name another folder by --out"
        ) from error
    if begun != plan:
        differing = [name for name in Plan.__struct_fields__ if getattr(begun, name) != getattr(plan, name)]
        raise RunFolderError(
            f"{folder} was begun with another {' and '.join(differing)} ("
            f"{', '.join(f'{name} {getattr(begun, name)}' for name in differing)}): go on with that, or name another "
            "folder by --out"
        )


class _CaseTask:
    """A case as what is run until it has a result (learning.sweeping.retrying.Task)."""

    def __init__(self, run: Path, plan: Plan, case: Case, folder: Path) -> None:
        self._run, self._plan, self._case, self._folder = run, plan, case, folder

    @property
    def name(self) -> str:
        return self._case.name

    def job(self) -> Job:
        plan = self._plan
        words = (
            "robustness", str(self._run), "--out", str(self._folder), "--tests", str(plan.n_tests),
            "--epochs", str(plan.n_more), "--seed", str(plan.seed), "--only", self.name,
        )  # fmt: skip
        return Job(name=self.name, words=words, memory_mb=CELL_MEMORY_MB)

    def n_done(self) -> int:
        return n_steps_done(self._folder / self.name)

    def is_finished(self) -> bool:
        return read_result(self._folder / self.name) is not None


def _run(tasks: list[_CaseTask], executor: Executor) -> JobRunner:
    console = Console(stderr=True)
    with StopRequest() as stop:
        runner = JobRunner(tasks, executor=executor, tries=TRIES, tell=console.print)
        try:
            while not runner.is_over:
                runner.look()
                if stop():
                    runner.stop()
                sleep(LOOK_S)
        finally:
            executor.close()
    return runner


def _carry_out(run: RunFolder, plan: Plan, case: Case, folder: Path) -> None:
    """Carry one case out in this process; leave with the exit code of an interrupt where it was stopped."""
    with StopRequest() as stop:
        done = run_case(run, plan, case, folder, now_s=perf_counter, progress_of=_progress, should_stop=stop)
    if done is None:
        typer.echo(f"{case.name}: stopped; the same command goes on", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)


def _progress(folder: RunFolder, n_done: int) -> Progress:
    manifest = folder.manifest()
    goals = [goal.name for goal in manifest.goals]
    return Progress(goals=goals, n_epochs=manifest.n_epochs, n_done=n_done, now_s=perf_counter)


def _end(runner: JobRunner, run: RunFolder, plan: Plan, folder: Path, *, json: bool) -> None:
    """Tell what is whole, and leave with the exit code of what is not."""
    results = [(case, result) for case in CASES if (result := read_result(folder / case.name)) is not None]
    if results:
        cases = tuple(bearing_of(case, result) for case, result in results)
        told = Robustness(plan=plan, goals=run.manifest().goals, cases=cases)
        write_atomically(folder / RESULT_NAME, msgspec.json.format(msgspec.json.encode(told), indent=2) + b"\n")
        paths = [folder / RESULT_NAME, *save(robustness_figure(told), folder, FIGURE_NAME)]
        if json:
            typer.echo(msgspec.json.encode(told).decode())
        else:
            Console().print(robustness_table(told))
            for path in paths:
                typer.echo(path)
    for name, why in runner.given_up.items():
        typer.echo(f"given up: {name}: {why}; what it said is in {folder / 'logs' / name}.log", err=True)
    if runner.given_up:
        raise typer.Exit(EXIT_FAILED)
    if len(results) < len(CASES):
        typer.echo(
            f"stopped with {len(CASES) - len(results)} of {len(CASES)} cases to go; the same command goes on", err=True
        )
        raise typer.Exit(EXIT_INTERRUPTED)
