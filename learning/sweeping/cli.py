"""`autotelic sweep FILE`: many runs as one job, here or on a cluster. The edge: terminal, files and host clock."""

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from time import perf_counter, sleep
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.live import Live

from config.errors import ConfigError
from config.loader import load_learning, load_rig, load_sweep, resolve
from config.sweep import Sweep
from learning.errors import LearningError, RunFolderError
from learning.report import Run, load_run
from learning.report_files import learners_of, write_report
from learning.run_folder import RunFolder
from learning.sweeping.cells import is_finished
from learning.sweeping.choosing import checked_place, make_executor
from learning.sweeping.executor import Executor
from learning.sweeping.manifest import take_folder
from learning.sweeping.runner import SweepRunner
from learning.sweeping.table import Pace, sweep_table
from learning.telling import report_tables
from robot.stop_request import StopRequest

__all__ = ["sweep"]

EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130
LOOK_S = 0.2
A_SECOND = 2


def sweep(
    file: Annotated[str, typer.Argument(help="Shipped sweep or a file.")],
    out: Annotated[Path | None, typer.Option(help="Folder of the sweep.  [default: runs/sweep-NAME]")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Cells at a time.  [default: one a processor]")] = None,
    on: Annotated[
        str,
        typer.Option(help="Who runs cells: `here`, `ray` (a Ray of this machine's own), or `ray:ADDRESS`, a cluster."),
    ] = "here",
    *,
    json: Annotated[bool, typer.Option("--json", help="Print the merged figures of merit as one JSON object.")] = False,
) -> None:
    """Run every learner of a sweep on every table with every seed, and merge what they come to.

    Ctrl-C ends each cell's epoch in hand and loses nothing (exit code 130). The same command goes on, whatever
    ended it.
    A cell that fails is tried again while it comes on; one that is given up is reported, and the exit code is 1.
    """
    try:
        wanted = load_sweep(file)
        n_epochs = _check(wanted)
        name = checked_place(on)
        folder = RunFolder(out or Path("runs") / f"sweep-{wanted.name}")
        with folder:
            executor = make_executor(name, jobs, folder.path / "logs")
            runner = _run(wanted, folder.path.absolute(), executor, n_epochs=n_epochs)
            _end(runner, json=json)
    except (ConfigError, LearningError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_USAGE if isinstance(error, ConfigError | RunFolderError) else EXIT_FAILED) from error


def _check(wanted: Sweep) -> int:
    """Check every file that a sweep names before anything is run, and return how many epochs its longest run has.

    Raises:
        ConfigError: one is missing or wrong, or a rig runs by the wall clock.
    """
    for name in wanted.rigs:
        if load_rig(name).address is not None:
            raise ConfigError(wanted.name, "rigs", "rigs in lock-step, which run side by side", f"{name}, with an arm")
    for rig in wanted.rigs:
        for scenario in wanted.scenarios:
            for preset in wanted.presets:
                resolve(rig=rig, scenario=scenario, learning=preset)
    return wanted.epochs or max(load_learning(preset).experiment.epochs for preset in wanted.presets)


def _run(wanted: Sweep, folder: Path, executor: Executor, *, n_epochs: int) -> SweepRunner:
    console = Console(stderr=True)
    shown: AbstractContextManager[Live | None] = (
        Live(console=console, refresh_per_second=A_SECOND, transient=True) if console.is_terminal else nullcontext()
    )
    manifest = take_folder(folder, wanted)
    begin_s = perf_counter()
    with shown as live, StopRequest() as stop:
        runner = SweepRunner(manifest, folder=folder, executor=executor, tell=console.print)
        pace = Pace(runner, n_epochs=n_epochs)
        try:
            while not runner.is_over:
                runner.look()
                if stop():
                    runner.stop()
                if live is not None:
                    live.update(sweep_table(runner, pace, seconds=perf_counter() - begin_s))
                sleep(LOOK_S)
        finally:
            executor.close()
    return runner


def _end(runner: SweepRunner, *, json: bool) -> None:
    """Merge what is whole, tell it, and leave with the exit code of what is not."""
    finished = [cell.name for cell in runner.cells if is_finished(cell, runner.folder)]
    if finished:
        _merge([load_run(RunFolder(runner.folder / name)) for name in finished], runner, json=json)
    n_left = len(runner.cells) - len(finished)
    for name, why in runner.given_up.items():
        typer.echo(f"given up: {name}: {why}; what it said is in {runner.folder / 'logs' / name}.log", err=True)
    if runner.given_up:
        raise typer.Exit(EXIT_FAILED)
    if n_left:
        typer.echo(f"stopped with {n_left} of {len(runner.cells)} cells to go; the same command goes on", err=True)
        raise typer.Exit(EXIT_INTERRUPTED)


def _named(run: Run) -> Run:
    """Return a run under its cell's name: what is merged does not tell where the sweep lies."""
    return msgspec.structs.replace(run, folder=Path(run.folder).name)


def _merge(runs: list[Run], runner: SweepRunner, *, json: bool) -> None:
    report, paths = write_report([_named(run) for run in runs], runner.folder / "report", learners=learners_of(runs))
    if json:
        typer.echo(msgspec.json.encode(report).decode())
        return
    Console().print(*report_tables(report))
    for path in paths:
        typer.echo(path)
